// Cuts the rings of percolating bodies at the faces of a periodic box.
#pragma once

#include <cstdint>
#include <vector>

#include "cut/line_cut.h"
#include "rings/percolation.h"
#include "rings/rings.h"
#include "vertices/intersections.h"
#include "vertices/ring_depths.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Warm buffers of CutRings.
struct RingCutScratch {
  Loops loops, kept;
  LineCutScratch line;
  std::vector<std::uint32_t> topology_ring;  // By ring: its ring of the topology.
  std::vector<std::uint32_t> group;          // By new ring: PlacedVertices::group_of_ring.
  std::vector<double> roots;
  std::vector<std::uint8_t> is_hole;     // By new ring.
  std::vector<std::uint32_t> continues;  // By new ring: the ring whose parents it has, or kNoRing.
  std::vector<std::uint32_t> largest;    // By body: its largest piece, a new ring.
  std::vector<std::uint8_t> seen;        // By body: 1 if it has pieces.
  Rings rings;
  TouchingPairsBuffers pairs;
  RingDepths depths;
};

struct RingCutInput {
  const Percolation& percolation;
  const RingTopology& topology;
  double spacing;  ///< World units.
  /// Whether rings share segments, in opposite directions, with rings that another call cuts. With
  /// the same steps, both calls find the same cut points, bit for bit.
  bool is_shared = false;
};

/// CutRings is tried with 0 steps, 1 step, and so on, up to this number of times.
inline constexpr int kMostCutSteps = 16;

/// Removes the rings of components with Fate::kGone. In `placed.kept_as`, they become kNoRing.
void RemoveGoneRings(const Percolation& percolation, const RingTopology& topology,
                     PlacedVertices& placed, Rings& rings);

/// Replaces the rings of components with Fate::kCut by their parts in the window. `rings.cuts`
/// lists the segments on the window's sides; perimeters do not count these segments. The largest
/// piece of a body has the identity, parents and number of particles of the body; the other pieces
/// have none. Holes that are not cut keep theirs. Sets `placed.group_of_ring`, keeps `placed.roots`
/// parallel to the points, and sets `cut_bodies` to the number of bodies with a ring that is cut.
///
/// Returns false, and changes nothing, if a ring has a vertex on a side, or if pieces would touch.
/// Then the caller tries again with more steps: all sides move by `steps` billionths of the
/// spacing, plus `steps` times 8 units in the last place of the farthest coordinate, opposite sides
/// in the same direction. If kMostCutSteps attempts fail, this is a bug. Cost: as CutAtLine,
/// CountTouchingPairs and RingDepths. Throws Cancelled as ThrowIfCancelled.
[[nodiscard]] bool CutRings(const RingCutInput& input, int steps, RingCutScratch& scratch,
                            PlacedVertices& placed, Rings& rings, std::uint64_t& cut_bodies);

/// Whether CutRings would return true. Changes only `scratch`.
[[nodiscard]] bool CanCutRings(const RingCutInput& input, int steps, RingCutScratch& scratch,
                               const PlacedVertices& placed, const Rings& rings);

/// Clears interior cells: all cells of components that are gone, and the cells of cut components
/// that are not strictly inside the window. Cost: linear in tiles.
void ClearOutside(const Percolation& percolation, const TileDirectory& directory,
                  const Components& components, double cell_size, Crossings& crossings);

}  // namespace partiemc
