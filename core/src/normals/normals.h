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

/// The level set at the point that represents a segment: its middle, or the weighted mean at the
/// cell's centre if vertices are particles (placement_traits.h). Results of float sums are floats,
/// because the planes of a frame do not fit into a cache.
struct CellPlane {
  ActiveCell cell;       ///< The cell of the segment; a copy, because a ring's cells are scattered.
  bool is_weak = false;  ///< The gradient was too small; the normal is a fallback.
  Point point;           ///< In cells from the origin of the world.
  Point entry, exit;     ///< Ends of the segment, on lattice edges.
  float value = 0;       ///< F at the point; if vertices are particles, at the cell's centre.
  float gradient_x = 0, gradient_y = 0;  ///< Of F, or of phi if vertices are particles.
  float size = 1;                        ///< The local size at the point, in spacings.
  double normal_x = 0, normal_y = 0;     ///< Unit normal, oriented (Eq. 11).
  /// `virtual-plane` only: F, its gradient and the local particle size, in spacings, at `entry`.
  float entry_value = 0;
  float entry_gradient_x = 0, entry_gradient_y = 0;
  float entry_size = 1;

  /// Outward direction of the segment itself, not normalised: the inside lies on its left.
  double OutwardX() const { return exit.y - entry.y; }
  double OutwardY() const { return entry.x - exit.x; }
};

/// Number of segments processed together.
inline constexpr std::size_t kSegmentsAtOnce = 64;

/// A gradient of F or phi with a smaller squared length is weak: its direction is unreliable.
inline constexpr double kWeakGradientSquare = 1e-3;

/// Scratch of EstimateNormals.
struct NormalScratch {
  CellsByRow cells_by_row;
  std::vector<std::uint32_t> previous;       ///< By active cell: index of its previous normal.
  std::vector<std::array<float, 2>> normal;  ///< By active cell: normal to store; 0 if none.
};

/// Results of the earlier stages.
struct NormalInput {
  const ParticleBins& bins;
  const Crossings& crossings;
  const RingTopology& topology;
  const LevelSetSampler& field;
  const ReconstructionParameters& parameters;
};

/// Computes one plane for each segment of the topology, in the order of the segments.
///
/// `previous` are the cell normals of the last frame (State::normals); `next` receives the normals
/// of this frame in the same order. A normal is oriented by the previous normal of its cell, if
/// there is one and `parameters.normal_memory` is set, else by the segment. If the gradient is
/// weak, the normal is the previous normal of the cell, else the mean of the reliable normals of
/// the two neighbours on the ring, else the normal of the segment.
///
/// Deterministic. Parallel over segments. Cost: one or two field samples for each segment.
void EstimateNormals(const NormalInput& input, std::span<const CellNormal> previous,
                     NormalScratch& scratch, std::vector<CellPlane>& planes,
                     std::vector<CellNormal>& next);

}  // namespace partiemc
