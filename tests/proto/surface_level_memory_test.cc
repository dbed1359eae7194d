// Memory of a level of detail in a message: what ReplaceByLevel reserves, and what it takes.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "core/heap_counts.h"
#include "partiemc/partiemc.h"
#include "wire/codec.h"
#include "wire/surface_level.h"

namespace partiemc::wire {
namespace {

// A lattice of `cubes`^3 bodies of `side`^3 particles each, with an attribute. The spacing is 1.
Result Cubes(int cubes, int side) {
  std::vector<double> positions;
  std::vector<float> values;
  for (int cube = 0; cube < cubes * cubes * cubes; ++cube) {
    for (int p = 0; p < side * side * side; ++p) {
      const double step = side + 6.3;
      positions.push_back(step * (cube % cubes) + p % side);
      positions.push_back(step * (cube / cubes % cubes) + p / side % side);
      positions.push_back(step * (cube / cubes / cubes) + p / side / side);
      values.push_back(static_cast<float>(p % 7));
    }
  }
  const Attribute attributes[] = {{.name = "number", .components = 1, .values = values}};
  ReconstructionParameters parameters;
  parameters.output = Output::kSurface;
  parameters.spacing = 1;
  const auto reconstructor = Reconstructor::Create(parameters);
  State state;
  Workspace workspace;
  Result result;
  const Frame frame{
      .positions = std::span<const double>(positions), .components = 3, .attributes = attributes};
  EXPECT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
  return result;
}

class LevelMemory : public ::testing::TestWithParam<Coordinates> {};
INSTANTIATE_TEST_SUITE_P(Coordinates, LevelMemory,
                         ::testing::Values(Coordinates::kFloat64, Coordinates::kRelativeFloat32,
                                           Coordinates::kCompact));

TEST_P(LevelMemory, IsReservedBeforeItIsTaken) {
  for (const auto& [cubes, side] : {std::pair(1, 50), std::pair(3, 12), std::pair(12, 2)}) {
    SCOPED_TRACE(side);
    v1::ReconstructedFrame exact;
    const Outputs outputs{.normals = true, .coordinates = GetParam()};
    ASSERT_TRUE(EncodeResult(Cubes(cubes, side), {}, outputs, exact).ok());
    for (const LevelOfDetail& level : {LevelOfDetail{.max_error = .1, .max_triangles = {}},
                                       LevelOfDetail{.max_error = {}, .max_triangles = 1000}}) {
      v1::ReconstructedFrame message = exact;
      const std::size_t before = support::live_bytes;
      support::peak_bytes = before;
      std::uint64_t reserved = 0;
      const auto reserve = [&](std::uint64_t bytes) {
        reserved = bytes;
        return absl::OkStatus();
      };
      ASSERT_TRUE(ReplaceByLevel(level, SurfaceOrigin::kUnknown, reserve, nullptr, message).ok());
      const std::size_t taken = support::peak_bytes - before;
      std::printf("%.2f times\n", static_cast<double>(reserved) / static_cast<double>(taken));
      EXPECT_LE(taken, reserved);
      EXPECT_GE(4 * static_cast<double>(taken), static_cast<double>(reserved));
    }
  }
}

}  // namespace
}  // namespace partiemc::wire
