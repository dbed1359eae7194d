// Kernel sums at nodes and points, in vectors. Every instruction set gives the same bits, because
// the order of each sum is fixed. Symbols are as in Sums and Slopes (level_set.h).
#pragma once

#include <array>

#include "base/vec3.h"
#include "space/level_set.h"
#include "space/near_particles.h"

namespace partiemc::space {

/// Partial sums by quantity and lane. The term of particle k of a block goes to lane k modulo
/// kLanes.
template <int kQuantities>
struct PartialSums {
  alignas(32) std::array<std::array<float, NearBlock::kLanes>, kQuantities> lanes{};

  double Total(int quantity) const {
    const auto& part = lanes[quantity];
    return ((double{part[0]} + double{part[4]}) + (double{part[2]} + double{part[6]})) +
           ((double{part[1]} + double{part[5]}) + (double{part[3]} + double{part[7]}));
  }
};

/// Sums of k, w k, k D, k D D^T; with own sizes of k, s k, k D, k D D^T.
using PartialMoments = PartialSums<11>;
/// Sums of t^2 D, t^2 D D^T, w t^2 D; with own sizes of t^2 D / s, t^2 D D^T / s, k / s.
using PartialSlopes = PartialSums<12>;
/// Sums of t^2 D (v . D)^2; with own sizes of t^2 D (v . D)^2 / s, k (v . D) / s.
using PartialThirds = PartialSums<4>;

/// A point in cells relative to the brick of a block.
struct QueryPoint {
  float x, y, z;
};

/// Each function adds the terms of the particles of a block to partial sums. `inverse_square`: 1 /
/// R^2 for the kernel radius R of size 1.
void AddMoments(const NearBlock& block, const QueryPoint& point, float inverse_square,
                PartialMoments& sums);
void AddMomentsAndSlopes(const NearBlock& block, const QueryPoint& point, float inverse_square,
                         PartialMoments& moments, PartialSlopes& slopes);
void AddThirds(const NearBlock& block, const QueryPoint& point, float inverse_square, const Vec3& v,
               PartialThirds& sums);

/// The totals of partial sums. `weight`: the weight of every particle if the bins have no weights,
/// else 1.
Sums TotalOf(const PartialMoments& sums, double weight);
Slopes TotalOf(const PartialSlopes& sums, double weight);

/// The totals of partial sums with own sizes. `weight`: of every particle. `kernel`: sum k.
Sums SizedTotalOf(const PartialMoments& sums, double weight);
Slopes SizedTotalOf(const PartialSlopes& sums, double weight, double kernel);

/// Adds the kernels of a run of particles, times the weights of the bins if they have weights, to
/// the 512 `nodes` of a brick, by layer, row, column. `radius`: the kernel radius of size 1.
/// Requires: `nodes` is aligned to 64 bytes.
void AddDensity(const SpaceBins& bins, const NearRun& run, float radius, float* nodes);

}  // namespace partiemc::space
