// Rings against the bilinear interpolant itself: its regions of either sign, found by sampling it
// finely and labelling what hangs together, without marching squares and without a decider for
// saddles. Each border between two regions must be one ring, and rings must lie in each other as
// regions do.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "partiemc/result.h"
#include "support/level_sets.h"
#include "support/stages.h"
#include "support/tries.h"

namespace partiemc {
namespace {

using support::LevelSetPatch;
using support::Random;
using support::Stages;

constexpr int kNodes = 8;     // Size of a patch in each direction.
constexpr int kSamples = 24;  // Samples of a cell in each direction.

// Pairs of an inside and an outside region.
using Borders = std::set<std::pair<int, int>>;

// The regions of either sign of the interpolant over a square of cells. The interpolant is linear
// along rows and columns of samples, so every region can be followed to a node. The regions of
// samples therefore equal those of the interpolant, except for necks between samples.
class Regions {
 public:
  // The cells from node (column, row), `cells` in each direction.
  Regions(const LevelSetPatch& patch, int column, int row, int cells)
      : column_(column), row_(row), side_(cells * kSamples + 1), parents_(side_ * side_) {
    std::iota(parents_.begin(), parents_.end(), 0);
    for (int k = 0; k < side_ * side_; ++k) {
      is_inside_.push_back(Value(patch, k % side_, k / side_) < 0);
      for (const int before : {Left(k), Below(k)}) {
        if (is_inside_[before] == is_inside_[k]) parents_[Find(k)] = Find(before);
      }
    }
  }

  int Of(int column, int row) { return Find(((row - row_) * side_ + column - column_) * kSamples); }

  // Every pair of an inside and an outside region that meet.
  Borders FindBorders() {
    Borders borders;
    for (int k = 0; k < side_ * side_; ++k) {
      for (const int before : {Left(k), Below(k)}) {
        if (is_inside_[before] == is_inside_[k]) continue;
        const auto [inside, outside] = is_inside_[k] ? std::pair(k, before) : std::pair(before, k);
        borders.insert({Find(inside), Find(outside)});
      }
    }
    return borders;
  }

 private:
  // The sample before, or the sample itself at the rim.
  int Left(int k) const { return k % side_ == 0 ? k : k - 1; }
  int Below(int k) const { return k < side_ ? k : k - side_; }

  double Value(const LevelSetPatch& patch, int x, int y) const {
    const int column = column_ + x / kSamples, row = row_ + y / kSamples;
    const double s = static_cast<double>(x % kSamples) / kSamples;
    const double t = static_cast<double>(y % kSamples) / kSamples;
    return (1 - t) * ((1 - s) * patch.At(column, row) + s * patch.At(column + 1, row)) +
           t * ((1 - s) * patch.At(column, row + 1) + s * patch.At(column + 1, row + 1));
  }

  int Find(int k) {
    while (parents_[k] != k) k = parents_[k] = parents_[parents_[k]];
    return k;
  }

  int column_, row_, side_;
  std::vector<bool> is_inside_;
  std::vector<int> parents_;
};

// True if the samples do not show how a saddle is connected: in its cell neither the inside nor the
// outside corners are joined.
bool IsUndecided(const LevelSetPatch& patch, int column, int row) {
  Regions cell(patch, column, row, 1);
  return cell.Of(column, row) != cell.Of(column + 1, row + 1) &&
         cell.Of(column + 1, row) != cell.Of(column, row + 1);
}

bool IsSaddle(const LevelSetPatch& patch, int column, int row) {
  const bool lower_left = patch.At(column, row) < 0;
  const bool lower_right = patch.At(column + 1, row) < 0;
  return lower_left != lower_right && (patch.At(column + 1, row + 1) < 0) == lower_left &&
         (patch.At(column, row + 1) < 0) == lower_right;
}

struct Saddles {
  int decided = 0, undecided = 0;
};

Saddles SaddlesOf(const LevelSetPatch& patch) {
  Saddles saddles;
  for (int row = -1; row < kNodes; ++row) {
    for (int column = -1; column < kNodes; ++column) {
      if (!IsSaddle(patch, column, row)) continue;
      ++(IsUndecided(patch, column, row) ? saddles.undecided : saddles.decided);
    }
  }
  return saddles;
}

// The regions on the left and right of a ring, at the nodes of its first edge.
std::pair<int, int> SidesOf(const Stages& stages, std::size_t ring, int offset, Regions& regions) {
  const double x = stages.result.rings.RingPoints(ring)[0] - offset;
  const double y = stages.result.rings.RingPoints(ring)[1] - offset;
  const auto at = [&](double column, double row) {
    const auto i = static_cast<int>(column), j = static_cast<int>(row);
    return std::pair(regions.Of(i, j),
                     stages.level_set.At(stages.bins.tiles, 0, i + offset, j + offset) < 0);
  };
  const auto low = at(std::floor(x), std::floor(y));
  const auto high = at(std::ceil(x), std::ceil(y));
  return low.second ? std::pair(low.first, high.first) : std::pair(high.first, low.first);
}

// The parent of each region: the region that contains it. The outermost is its own parent.
std::map<int, int> ParentsOf(const Borders& borders, int outermost) {
  std::map<int, int> parents{{outermost, outermost}};
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (const auto& border : borders) {
      for (const auto& [known, next] : {border, std::pair(border.second, border.first)}) {
        if (!parents.contains(known) || parents.contains(next)) continue;
        parents[next] = known;
        has_grown = true;
      }
    }
  }
  return parents;
}

void ExpectRingsAreBorders(const LevelSetPatch& patch, Stages& stages) {
  constexpr int kOffset = 28;  // Across the corner of four tiles.
  stages.RunOn([&](int x, int y) { return patch.At(x - kOffset, y - kOffset); }, {0, 0}, {1, 1}, {},
               {.placement = Placement::kMarchingSquares,
                .fill = Fill::kNone,
                .spacing = 1.0,
                .clean = false});
  const Rings& rings = stages.result.rings;
  Regions regions(patch, -1, -1, kNodes + 1);
  const Borders borders = regions.FindBorders();
  const std::map<int, int> parents = ParentsOf(borders, regions.Of(-1, -1));
  ASSERT_EQ(rings.RingCount(), borders.size());
  std::map<std::pair<int, int>, std::size_t> ring_of;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const auto sides = SidesOf(stages, ring, kOffset, regions);
    ASSERT_TRUE(borders.contains(sides)) << "ring " << ring << " borders on other regions";
    ASSERT_TRUE(ring_of.emplace(sides, ring).second) << "ring " << ring << " is one too many";
  }
  for (const auto& [sides, ring] : ring_of) {
    const auto [inside, outside] = sides;
    if (parents.at(inside) == outside) {
      EXPECT_EQ(rings.outer_of[ring], kNoRing) << "ring " << ring;
      EXPECT_GT(rings.measures[ring].area, 0) << "ring " << ring;
    } else {
      ASSERT_EQ(parents.at(outside), inside);
      EXPECT_EQ(rings.outer_of[ring], ring_of.at({inside, parents.at(inside)})) << "ring " << ring;
      EXPECT_LT(rings.measures[ring].area, 0) << "ring " << ring;
    }
  }
}

TEST(Bilinear, RingsAreTheBordersOfItsRegionsAndLieInEachOtherAsThoseDo) {
  Stages stages;
  Saddles total;
  std::size_t compared = 0, rings = 0, holes = 0;
  for (std::uint64_t seed = 1; seed <= support::Tries(2'000u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Random random(seed);
    const LevelSetPatch patch = support::RandomPatch(random, kNodes, kNodes);
    const Saddles saddles = SaddlesOf(patch);
    total.decided += saddles.decided;
    total.undecided += saddles.undecided;
    if (saddles.undecided > 0) continue;
    ExpectRingsAreBorders(patch, stages);
    if (HasFailure()) break;
    ++compared;
    rings += stages.result.rings.RingCount();
    for (const std::uint32_t outer : stages.result.rings.outer_of) holes += outer != kNoRing;
  }
  // Enough cases were compared. Undecided are the flattest saddles, and saddles with neighbours of
  // very different magnitudes.
  EXPECT_GT(compared, support::Tries(1'200u));
  EXPECT_GT(rings, support::Tries(7'000u));
  EXPECT_GT(holes, support::Tries(1'000u));
  EXPECT_GT(total.decided, 6 * total.undecided);
}

}  // namespace
}  // namespace partiemc
