// Kernel sums at nodes and points, in vectors. Every instruction set gives the same bits: terms go
// to eight partial sums by their index, and the partial sums are added by halves.
#pragma once

#include <array>

#include "base/vec3.h"
#include "space/level_set.h"
#include "space/near_particles.h"

namespace partiemc::space {

/// Partial sums of floats: by quantity, by lane.
template <int kQuantities>
struct PartialSums {
  alignas(32) std::array<std::array<float, NearBlock::kLanes>, kQuantities> lanes{};

  double Total(int quantity) const {
    const auto& part = lanes[quantity];
    return ((double{part[0]} + double{part[4]}) + (double{part[2]} + double{part[6]})) +
           ((double{part[1]} + double{part[5]}) + (double{part[3]} + double{part[7]}));
  }
};

/// With own sizes s, D is divided by s, and s takes the place of the weight w.
using PartialMoments = PartialSums<11>;  ///< k, w k, k D, k D D^T.
/// t^2 D, t^2 D D^T, w t^2 D; with own sizes t^2 D / s, t^2 D D^T / s, k / s.
using PartialSlopes = PartialSums<12>;
/// t^2 D (v . D)^2; with own sizes t^2 D (v . D)^2 / s, k (v . D) / s.
using PartialThirds = PartialSums<4>;

/// A point in cells relative to the brick of a block.
struct QueryPoint {
  float x, y, z;
};

/// Each function adds the terms of the particles of a block to partial sums.
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

/// Adds the kernels of a run of particles, times their weights, to the nodes of a brick, by layer,
/// row, column. `radius`: the kernel radius of size 1.
void AddDensity(const SpaceBins& bins, const NearRun& run, float radius, float* nodes);

}  // namespace partiemc::space
