#include "space/field.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "space/brick_blocks.h"
#include "space/near_particles.h"
#include "space/point_sampler.h"
#include "space/point_sums.h"

namespace partiemc::space {
namespace {

/// Rows near BoxOfBlock.
NearRows RowsOf(const Scale& scale) { return {1, static_cast<float>(scale.kernel_radius)}; }

/// Rows near BoxOfBlock, and near the box of all nodes of a brick.
struct FieldRows {
  NearRows block, brick;

  explicit FieldRows(const Scale& scale)
      : block(RowsOf(scale)), brick(kBrickSize - 1, static_cast<float>(scale.kernel_radius)) {}
};

NearBox BoxOfBlock(int i, int j, int k) {
  const auto x = static_cast<float>(i), y = static_cast<float>(j), z = static_cast<float>(k);
  return {{x, y, z}, {x + 1, y + 1, z + 1}};
}

void EvaluateBrick(const SpaceBins& bins, const Scale& scale, std::uint32_t brick,
                   const NearRows& rows, const BrickBits& nodes, SpaceField& field) {
  PointSampler sampler(bins, scale, &rows);
  ForEachInBlocks(
      nodes, [&](int i, int j, int k) { sampler.MoveTo(brick, BoxOfBlock(i, j, k)); },
      [&](int i, int j, int k) {
        field.values[brick][BrickPlace{brick, i, j, k}.Index()] =
            static_cast<float>(sampler.Value(Vec3{1.0 * i, 1.0 * j, 1.0 * k}));
        field.exact[brick][k] |= std::uint64_t{1} << (j * kBrickSize + i);
      });
}

/// Sums the density at the nodes of a brick, without the uniform weight.
void SumDensity(const SpaceBins& bins, const Scale& scale, const NearRows& rows,
                std::uint32_t brick, std::array<float, kBrickNodes>& density) {
  const auto radius = static_cast<float>(scale.kernel_radius);
  density = {};
  const auto add = [&](const NearRun& run) { AddDensity(bins, run, radius, density.data()); };
  if (bins.size.empty() && rows.is_exact()) return rows.ForEachRun(bins, brick, {0, 0, 0}, add);
  const NearBox all{{0, 0, 0}, {7, 7, 7}};
  ForEachNearRun(bins, brick, all, radius, add);
}

void SampleBrick(const SpaceBins& bins, const Scale& scale, const FieldRows& rows,
                 std::uint32_t brick, SpaceField& field) {
  alignas(64) std::array<float, kBrickNodes> density;
  SumDensity(bins, scale, rows.brick, brick, density);
  const float weight = bins.weight.empty() ? static_cast<float>(scale.uniform_weight) : 1.0f;
  const auto guard = static_cast<float>(scale.guard);
  const auto saturation = static_cast<float>(scale.saturation);
  const auto slope = static_cast<float>(scale.guard_slope);
  BrickBits& inside = field.inside[brick] = {};
  BrickBits open{};
  auto& values = field.values[brick];
  for (int node = 0; node < kBrickNodes; ++node) {
    const float f = weight * density[node];
    const std::uint64_t bit = std::uint64_t{1} << node % (kBrickSize * kBrickSize);
    const int layer = node / (kBrickSize * kBrickSize);
    // Above f_1 the saturation term decides the side, up to f_0 the guard term.
    if (f > saturation) {
      inside[layer] |= bit;
      values[node] = (saturation - f) * slope;
    } else if (f > guard) {
      open[layer] |= bit;
    } else {
      values[node] = (guard - f) * slope;
    }
  }
  field.exact[brick] = {};
  EvaluateBrick(bins, scale, brick, rows.block, open, field);
  for (int layer = 0; layer < kBrickSize; ++layer) {
    for (std::uint64_t bits = open[layer]; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      const bool is_inside = values[layer * kBrickSize * kBrickSize + bit] < 0;
      inside[layer] |= std::uint64_t{is_inside} << bit;
    }
  }
}

}  // namespace

void SampleField(const SpaceBins& bins, const Scale& scale, SpaceField& field) {
  const std::size_t bricks = bins.bricks.size();
  field.values.resize(bricks);
  field.inside.resize(bricks);
  field.exact.resize(bricks);
  const FieldRows rows(scale);
  ParallelFor(static_cast<std::uint32_t>(bricks),
              [&](std::uint32_t brick) { SampleBrick(bins, scale, rows, brick, field); });
}

void EvaluateNodes(const SpaceBins& bins, const Scale& scale, const std::vector<BrickBits>& nodes,
                   SpaceField& field) {
  const NearRows rows = RowsOf(scale);
  ParallelFor(static_cast<std::uint32_t>(nodes.size()), [&](std::uint32_t brick) {
    BrickBits missing;
    std::uint64_t any = 0;
    for (int layer = 0; layer < kBrickSize; ++layer) {
      missing[layer] = nodes[brick][layer] & ~field.exact[brick][layer];
      any |= missing[layer];
    }
    if (any == 0) return;
    EvaluateBrick(bins, scale, brick, rows, missing, field);
    // The density of SampleBrick decided whether a node is inside. At f_0 and f_1, rounding may
    // give F another sign here. F is then set to 0 outside, and to just below 0 inside.
    for (int layer = 0; layer < kBrickSize; ++layer) {
      for (std::uint64_t bits = missing[layer]; bits != 0; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        float& value = field.values[brick][layer * kBrickSize * kBrickSize + bit];
        const bool is_inside = (field.inside[brick][layer] >> bit & 1) != 0;
        if (is_inside != (value < 0)) {
          value = is_inside ? -std::numeric_limits<float>::min() : 0.0f;
        }
      }
    }
  });
}

}  // namespace partiemc::space
