// Corners of the body's outline where interfaces end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/point.h"
#include "partiemc/result.h"
#include "phases/arc_curve.h"
#include "phases/interfaces.h"
#include "phases/phase_images.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

/// Values of JunctionScratch::has_moved: the vertex has moved; the vertex has moved and is a corner
/// of the outline (CornerOf) where interfaces end. 0: it has not moved.
inline constexpr std::uint8_t kMoved = 1, kMovedCorner = 2;

/// The vertices of a ring of the body after a vertex (`is_ahead`) or before it, nearest first. The
/// path ends at kCurvatureFarthest spacings along the ring, or before the next vertex where
/// interfaces end or that lies on a wall.
class RingPath {
 public:
  /// Lengths are in cells. `ends_path`: by vertex, whether the path ends before it.
  RingPath(const Rings& body, std::uint32_t vertex, bool is_ahead, double spacing,
           std::span<const std::uint8_t> ends_path, std::span<const Point> positions);
  std::size_t size() const { return size_; }
  std::uint32_t operator[](std::size_t k) const;

 private:
  std::uint32_t begin_, count_, vertex_;
  bool is_ahead_;
  std::size_t size_ = 0;
};

/// The curves of both sides of a vertex, relative to it.
struct BodyCorner {
  ArcCurve ahead, back;
};

/// The corner of the body's outline at a vertex. Absent if a side is too short for a curve or
/// deviates from it, or if the outline turns by less than 24 degrees.
std::optional<BodyCorner> CornerOf(const RingPath& ahead, const RingPath& back, const Point& vertex,
                                   double spacing, std::span<const Point> positions);

/// Keeps the areas of the rings of the body while their corners move. The outer rings of a body
/// that will be cut count as one, by their parts in the window, so that the outline continues
/// across the faces. Reuses its memory.
class RingAreas {
 public:
  /// Measures the rings. `images`: after Build.
  void Measure(const Rings& body, const PhaseImages& images, std::span<const Point> positions);

  /// For each ring with a corner: moves all its vertices along their normals by one offset, at most
  /// `limit` cells in both directions. The offset restores the area, to first order. Vertices on
  /// walls stay. `walls`: by vertex; null without walls. `has_moved`: by vertex, kMovedCorner at
  /// corners; sets the elements of vertices that move and are 0 to kMoved. Requires: Measure.
  void Restore(const Rings& body, const WallVertices* walls, const PhaseImages& images,
               double limit, std::span<std::uint8_t> has_moved, SharedPoints& points);

 private:
  // Sums over a group of rings (PhaseImages::GroupOf).
  struct Group {
    double before = 0, now = 0, length = 0;  // Areas, in squared cells; length, in cells.
    bool has_corner = false;
  };

  double AreaOf(const Rings& body, std::uint32_t ring, const PhaseImages& images,
                std::span<const Point> positions);
  // The length of the segments that move: those off the walls, and half of those with one end on a
  // wall.
  double LengthOf(const Rings& body, std::uint32_t ring, const WallVertices* walls,
                  const PhaseImages& images, std::span<const Point> positions) const;

  std::vector<Group> groups_;  // By ring; only the first ring of a group has its sums.
  std::vector<double> ring_;   // Points of a ring, interleaved.
};

}  // namespace partiemc
