// Triangulates the region between two loops in linear time, where walking along both at once will
// do.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/point.h"

namespace partiemc {

/// A way round Triangulator (triangulate.h) for regions like a ring: two loops that run side by
/// side, as a contour does and the staircase of the cells inside it.
///
/// Method: two walkers start next to each other, one on each loop, and go round once, whichever is
/// behind first. The front is a polyline from one walker to the other. At every step the new point
/// cuts triangles off its end of the front as long as they turn counter-clockwise, then joins it.
///
/// Why what comes out is right: each triangle takes two sides of the front away and puts its third
/// in their place, so that the sides of all triangles and of the front always are, but for sides
/// that cancel, the first front and the ways that the walkers have come. In the end both stand
/// where they began. If the front is what it was at first, a single side, nothing but the loops is
/// left: as in side_balance.h, each point lies in as many triangles as the loops wind round it,
/// which is once in the region, never elsewhere. So every choice on the way is free; one that was
/// wrong leaves a front that is not used up, and the strip is refused.
/// One object per thread; it keeps its buffers warm.
class LoopStrip {
 public:
  /// Appends as many triangles as the loops have points together, all strictly counter-clockwise by
  /// Orientation. Or returns false, with `triangles` as it was: then nothing is known of the loops.
  /// Refuses loops that do not turn once each, one of them clockwise, whatever they bound, and
  /// coordinates out of the domain of predicates.h.
  /// Requires: indices in range, no empty loop, and loops that bound a region as Triangulator wants
  /// them. That is not checked: of loops that run into themselves, triangles may overlap.
  /// Cost: linear in the points, with two or three Orientations and two distances for each.
  [[nodiscard]] bool Triangulate(std::span<const double> points,
                                 std::span<const std::uint32_t> loop,
                                 std::span<const std::uint32_t> other,
                                 std::vector<std::uint32_t>& triangles);

 private:
  struct Vertex {
    Point point;
    std::uint32_t index = 0;
  };

  static int Turns(std::span<const Vertex> vertices);
  bool Collect(std::span<const double> points, std::span<const std::uint32_t> loop,
               std::span<const std::uint32_t> other);

  std::vector<Vertex> loop_, other_;  // Once round, from where the walkers start back to there.
  std::vector<Vertex> front_;         // A walker's end grows down from the middle, the other's up.
};

}  // namespace partiemc
