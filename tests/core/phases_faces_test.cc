// Phases in periodic boxes: interfaces end at the same points of opposite faces.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "core/boxes.h"
#include "core/phases_in_boxes.h"
#include "partiemc/partiemc.h"
#include "support/reconstruct.h"

namespace partiemc {
namespace {

using support::Particles;
using support::ReconstructOnce;

// Two phases side by side in turn, above a third one. `widths`: of the regions above, an even
// number of them, from x = 0.
Particles Upright(const std::vector<double>& widths, double noise) {
  const double length = std::accumulate(widths.begin(), widths.end(), 0.);
  return Labelled(static_cast<int>(length), 20, noise, [&](double x, double y) {
    if (y < 9.3) return 3;
    int region = 0;
    for (double end = widths[0]; x > end; end += widths[region]) ++region;
    return 1 + region % 2;
  });
}

// The heights at which the outline of a phase ends at the lower and the upper face along x.
std::array<std::vector<double>, 2> HeightsAtFaces(const Rings& rings, double middle) {
  std::array<std::vector<double>, 2> heights;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t begin = rings.offsets[ring], end = rings.offsets[ring + 1];
    for (std::uint32_t k = begin; k < end; ++k) {
      if (!std::ranges::binary_search(rings.cuts, k)) continue;
      for (const std::uint32_t point : {k, k + 1 < end ? k + 1 : begin}) {
        const std::size_t face = rings.points[2 * point] < middle ? 0 : 1;
        heights[face].push_back(rings.points[2 * point + 1]);
      }
    }
  }
  for (std::vector<double>& of_face : heights) std::ranges::sort(of_face);
  return heights;
}

// The largest difference between opposite faces along x, for faces at each whole number of cells
// plus `shift`. `length`: of the box.
double LargestStep(const Particles& scene, double length, double shift) {
  double largest = 0;
  for (double origin = shift; origin < length; ++origin) {
    SCOPED_TRACE(testing::Message() << "origin " << origin);
    const PeriodicBox box{.axes = {PeriodicAxis{origin, length}, std::nullopt, std::nullopt}};
    const Result result = ReconstructOnce(PhasesIn(box, 3), Wrapped(scene, box));
    ExpectDivided(result, Fill::kGreedy);
    for (const Result& phase : result.sections) {
      const auto [lower, upper] = HeightsAtFaces(phase.rings, origin + length / 2);
      EXPECT_EQ(lower.size(), upper.size());
      for (std::size_t k = 0; k < std::min(lower.size(), upper.size()); ++k) {
        largest = std::max(largest, std::abs(lower[k] - upper[k]));
      }
    }
  }
  return largest;
}

// Curves read points up to 9 h away, so each junction depends on the places of its neighbours.
TEST(PhasesPeriodic, InterfacesContinueNearCloseJunctions) {
  double largest = 0;
  for (const double noise : {0., .1}) {
    const Particles scene = Upright({5, 6, 7, 8, 5, 6, 5, 6}, noise);
    for (const double shift : {0., .37}) {
      largest = std::max(largest, LargestStep(scene, 48, shift));
    }
  }
  std::printf("junctions 5 to 8 h apart: ends at opposite faces differ by %.1e\n", largest);
  EXPECT_LT(largest, 1e-4);
}

// Copies reach one length beyond the faces, less than the curves of junctions there.
TEST(PhasesPeriodic, InterfacesContinueInShortBoxes) {
  double largest = 0;
  for (const auto& [first, second] : {std::pair(5., 7.), {6., 7.}, {6., 8.}, {7., 8.}, {8., 8.}}) {
    const Particles scene = Upright({first, second}, .1);
    for (const double shift : {0., .37}) {
      largest = std::max(largest, LargestStep(scene, first + second, shift));
    }
  }
  std::printf("boxes of 12 to 16 h: ends at opposite faces differ by %.1e\n", largest);
  EXPECT_LT(largest, 1e-3);
}

// In narrow stripes, some regions have no particle of their phase.
TEST(PhasesPeriodic, InterfacesContinueInNarrowStripes) {
  double largest = 0;
  for (const double width : {2., 7. / 3}) {
    for (const int rows : {4, 13}) {
      const double length = 6 * width;
      const Particles scene = Labelled(static_cast<int>(length), rows, .2, [=](double x, double) {
        return 1 + static_cast<int>(x / width) % 3;
      });
      for (const double shift : {0., .37}) {
        const double step = LargestStep(scene, length, shift);
        largest = std::max(largest, step);
      }
    }
  }
  std::printf("stripes of 2 h: ends at opposite faces differ by %.1e\n", largest);
  EXPECT_LT(largest, 1e-3);
}

}  // namespace
}  // namespace partiemc
