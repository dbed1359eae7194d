// Stage 5 of 9: segments -> stabilised cell normals (paper, Eq. 9-11).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "crossings/crossings.h"
#include "crossings/scanlines.h"
#include "partiemc/parameters.h"
#include "partiemc/state.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"

namespace partiemc {

/// The level set at the point that represents a segment: the middle of the segment, or the weighted
/// mean at the cell's centre where vertices are particles (placement_traits.h).
/// Sums of floats stay floats, because the planes of a frame do not fit into a cache.
struct CellPlane {
  ActiveCell cell;       ///< Of the segment: along a ring, cells lie anywhere in memory.
  bool is_weak = false;  ///< The gradient was too small; the normal is a fallback.
  Point point;           ///< Lattice coordinates of the world, in cells.
  Point entry, exit;     ///< The segment's ends: linear crossings of lattice edges.
  float value = 0;       ///< F at the point.
  float gradient_x = 0, gradient_y = 0;  ///< Of F; of phi where vertices are particles.
  double normal_x = 0, normal_y = 0;     ///< Unit, oriented (Eq. 11).
  /// `virtual-plane` only: F and its gradient at `entry`.
  float entry_value = 0;
  float entry_gradient_x = 0, entry_gradient_y = 0;

  /// Outward direction of the segment itself, not normalised: the inside lies on its left.
  double OutwardX() const { return exit.y - entry.y; }
  double OutwardY() const { return entry.x - exit.x; }
};

/// Segments of a task.
inline constexpr std::size_t kSegmentsAtOnce = 64;

/// Below this squared length a gradient of F or phi says nothing about direction (METHOD, 14).
inline constexpr double kWeakGradientSquare = 1e-3;

/// Warm buffers of EstimateNormals.
struct NormalScratch {
  CellsByRow cells_by_row;
  std::vector<std::uint32_t> previous;  ///< By active cell: which of the previous normals is its.
  /// By active cell: its normal to remember; 0 where it has none.
  std::vector<std::array<float, 2>> normal;
};

/// One plane per segment of `rings`, in their order. `previous` are the cell normals of the frame
/// before (State::normals); `next` receives those of this one, sorted the same way.
/// Orientation: by the previous normal of the cell where there is one and parameters ask for it,
/// else by the segment. Weak gradients take the previous normal, else the mean of the ring's
/// neighbouring reliable ones, else the segment's own.
/// Deterministic, in parallel over segments. Cost: a field sample per segment.
void EstimateNormals(const ParticleBins& bins, const Crossings& crossings,
                     const RingTopology& rings, const LevelSetSampler& field,
                     const ReconstructionParameters& parameters,
                     std::span<const CellNormal> previous, NormalScratch& scratch,
                     std::vector<CellPlane>& planes, std::vector<CellNormal>& next);

}  // namespace partiemc
