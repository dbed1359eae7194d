#include "frame/spacing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "base/bits.h"
#include "base/parallel.h"
#include "frame/near_ring.h"
#include "frame/neighbour_tree.h"
#include "partiemc/spacing.h"

namespace partiemc {
namespace {

// Approximate size of the sample: the median distance in the sample is within a percent of the
// median distance of all particles.
constexpr std::size_t kSampleSize = 1 << 14;

// A particle is spray if its nearest neighbour is farther away than this number of medians. Inside
// bodies, distances stay below two medians.
constexpr double kLonelyRatio = 4;

// Each round uses the spacing that the round before found; thinned particles need the third round.
constexpr int kDensityRounds = 3;
// With fewer surrounded test points, bodies are too thin or too small for a density, and the
// spacing is the median distance.
constexpr std::size_t kMinFilledPoints = 32;
// Relative error of the kernel sums in small or thin bodies. If the spacing by density is closer to
// the median distance than this error, the median distance is the better estimate; on lattices it
// is exact.
constexpr double kSumTolerance = 0.05;

// A kernel sum over groups of positions has at most this number of groups. If there are more, each
// group gets kGroupGrowth times as many positions.
constexpr std::size_t kMostGroups = 1 << 10;
constexpr std::size_t kGroupGrowth = 8;

// The constants and functions of each dimension.
// - kRadius: radius of the kernel sums, in spacings.
// - kWider: factor of the radius if the first round finds too few test points, because nearest
//   neighbours of random points are much closer than a spacing.
// - A test point counts if particles surround it: if the weighted mean of the particles lies within
//   kMaxImbalance radii of the point, and their weighted mean square distance, in squared radii,
//   lies between kMinSpread and kMaxSpread. A filled disk has 1/5, a filled ball 3/11.
// - kDirections: offsets of the test points from the sampled particles, in kernel radii. At
//   the distance 1 the particle itself adds nothing to the kernel sum, so the mean of the sums is
//   unbiased for any arrangement.
// - kIntegral: integral of the kernel with radius 1 over the plane or space.
// - kMostTerms: a kernel sum over more positions is taken over groups of them. The square around a
//   disk has up to 42 positions of equal spacing, packed as densely as possible, and the cube
//   around a ball up to 177. Where particles are ten times finer than most others, about the
//   largest ratio of sizes, these are 4,200 and 177,000. (In the wider sums, the ratio is six.) So
//   only frames with an even denser minority reach the limit.
template <typename Place>
struct InDimension;
template <>
struct InDimension<Point> {
  static constexpr double kRadius = 3, kWider = 1;
  static constexpr double kMaxImbalance = 0.15, kMinSpread = 0.17, kMaxSpread = 0.25;
  static constexpr double kIntegral = 0.78539816339744830962;  // pi / 4.
  static constexpr std::size_t kMostTerms = 4'500;
  static constexpr Point kDirections[] = {{1, 0},       {0.8, 0.6},  {0.6, 0.8},  {0, 1},
                                          {-0.6, 0.8},  {-0.8, 0.6}, {-1, 0},     {-0.8, -0.6},
                                          {-0.6, -0.8}, {0, -1},     {0.6, -0.8}, {0.8, -0.6}};
  static double RootOf(double measure) { return std::sqrt(measure); }
  static Point Moved(const Point& at, double by, const Point& direction) {
    return {at.x + by * direction.x, at.y + by * direction.y};
  }
  static bool IsBefore(const Point& a, const Point& b) {
    return a.x != b.x ? a.x < b.x : a.y < b.y;
  }
};
template <>
struct InDimension<Vec3> {
  static constexpr double kRadius = 2.5, kWider = 1.6;
  static constexpr double kMaxImbalance = 0.1, kMinSpread = 0.25, kMaxSpread = 0.3;
  static constexpr double kIntegral = 0.63829184073;  // 64 pi / 315.
  static constexpr std::size_t kMostTerms = 180'000;
  static constexpr Vec3 kDirections[] = {
      {1, 0, 0},       {0, 0.8, 0.6},   {0.6, 0, 0.8},  {0.8, 0.6, 0},   {-1, 0, 0},
      {0, -0.8, -0.6}, {-0.6, 0, -0.8}, {0.8, -0.6, 0}, {0, 0.8, -0.6},  {-0.6, 0, 0.8},
      {-0.8, 0.6, 0},  {0, -0.8, 0.6},  {0.6, 0, -0.8}, {-0.8, -0.6, 0}, {0, 1, 0},
      {0, 0, 1},       {0, -1, 0},      {0, 0, -1}};
  static double RootOf(double measure) { return CubeRoot(measure); }
  static Vec3 Moved(const Vec3& at, double by, const Vec3& direction) {
    return at + by * direction;
  }
  static bool IsBefore(const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  }
};

// The squared distance of the nearest other position.
struct Nearest {
  double square = std::numeric_limits<double>::infinity();

  template <typename Place>
  void Add(const Place& offset) {
    const double next = SquareOf(offset);
    if (next > 0) square = std::min(square, next);
  }
  double reach_square() const { return square; }
};

// A NearRing of points.
struct RingOfPoints : NearRing {
  void Add(const Point& offset) { NearRing::Add(offset.x, offset.y); }
};

// The kernel sums at a point. Operator() returns false at more than `most_terms` terms.
template <typename Place>
struct KernelSums {
  using Dimension = InDimension<Place>;

  double radius;
  std::size_t most_terms;
  double inverse = 1 / radius;
  std::size_t terms = 0;
  double weight = 0, spread = 0;  // In radii.
  Place moment{};

  // Adds `count` positions at one place in the square or cube around the point.
  bool operator()(const Place& offset, std::size_t count) {
    if (++terms > most_terms) return false;
    if (SquareOf(offset) >= radius * radius) return true;
    const Place arm = Dimension::Moved({}, inverse, offset);
    const double square = SquareOf(arm);
    const double t = 1 - square;
    const double k = t * t * t * static_cast<double>(count);
    weight += k;
    moment = Dimension::Moved(moment, k, arm);
    spread += k * square;
    return true;
  }
  bool IsFilled() const {
    const double reach = Dimension::kMaxImbalance * weight;
    return SquareOf(moment) <= reach * reach && spread >= Dimension::kMinSpread * weight &&
           spread <= Dimension::kMaxSpread * weight;
  }
};

// The kernel sum at a point; 0 if particles do not surround the point. Where a minority of the
// particles is dense, `radius` may contain a large part of the frame. A sum of more than kMostTerms
// terms is repeated over groups of positions, each group at one place, in at most kMostGroups
// terms.
template <typename Place>
double FilledWeight(std::span<const Place> tree, const Place& point, double radius) {
  std::size_t most_terms = InDimension<Place>::kMostTerms;
  for (std::size_t group = 1;; group *= kGroupGrowth) {
    KernelSums<Place> sums{radius, most_terms};
    if (VisitAround(tree, point, radius, group, sums)) return sums.IsFilled() ? sums.weight : 0;
    most_terms = kMostGroups;
  }
}

// The spacing that follows from the density inside bodies. Empty if too few test points are
// surrounded.
template <typename Place>
std::optional<double> SpacingOfDensity(std::span<const Place> tree, std::span<const Place> asked,
                                       double radius, std::vector<double>& weights) {
  using Dimension = InDimension<Place>;
  weights.resize(asked.size());
  ParallelFor(asked.size(), [&](std::size_t k) {
    const Place& direction = Dimension::kDirections[k % std::size(Dimension::kDirections)];
    weights[k] = FilledWeight(tree, Dimension::Moved(asked[k], radius, direction), radius);
  });
  std::erase(weights, 0.0);
  if (weights.size() < kMinFilledPoints) return std::nullopt;
  double sum = 0;
  for (const double weight : weights) sum += weight;
  return radius *
         Dimension::RootOf(Dimension::kIntegral * static_cast<double>(weights.size()) / sum);
}

std::uint64_t HashOf(double x, double y) {
  // + 0.0 maps -0 to 0.
  std::uint64_t hash = std::bit_cast<std::uint64_t>(x + 0.0) * 0x9e3779b97f4a7c15u;
  hash ^= hash >> 32;
  hash = (hash ^ std::bit_cast<std::uint64_t>(y + 0.0)) * 0xc2b2ae3d27d4eb4fu;
  return hash ^ hash >> 29;
}
std::uint64_t HashOf(const Point& at) { return HashOf(at.x, at.y); }
std::uint64_t HashOf(const Vec3& at) {
  return HashOf(std::bit_cast<double>(HashOf(at.x, at.y) >> 2), at.z);
}

double MedianOf(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The median distance of the surrounded particles in the sample (NearRing::Distance). Empty unless
// enough of them have a distance within a factor of two of this median. `asked_in_company`: the
// number of sampled particles that are not spray.
std::optional<double> AgreedDistance(std::span<const Point> tree, std::span<const Point> asked,
                                     std::size_t asked_in_company, std::vector<double>& distances) {
  distances.resize(asked.size());
  ParallelFor(asked.size(), [&](std::size_t k) {
    RingOfPoints ring;
    GatherNearest(tree, asked[k], ring);
    distances[k] = ring.IsAround() ? ring.Distance() : 0;
  });
  std::erase(distances, 0.0);
  if (!AreEnough(distances.size(), asked_in_company)) return std::nullopt;
  const double median = MedianOf(distances);
  const auto agreeing = std::count_if(distances.begin(), distances.end(), [&](double distance) {
    return distance <= 2 * median && 2 * distance >= median;
  });
  if (!AreEnough(static_cast<std::size_t>(agreeing), asked_in_company)) return std::nullopt;
  return median;
}

// Refines a distance between neighbours to the spacing by density. Returns the distance itself if
// both agree within the error of the sums, or if bodies are too thin for a density.
template <typename Place>
double RefineSpacing(double distance, std::span<const Place> tree, std::span<const Place> asked,
                     std::vector<double>& weights) {
  using Dimension = InDimension<Place>;
  double spacing = distance;
  for (int round = 0; round < kDensityRounds; ++round) {
    const double radius = Dimension::kRadius * spacing;
    std::optional<double> dense = SpacingOfDensity(tree, asked, radius, weights);
    if (!dense && round == 0 && Dimension::kWider > 1) {
      dense = SpacingOfDensity(tree, asked, Dimension::kWider * radius, weights);
    }
    if (!dense) break;
    spacing = *dense;
  }
  return std::abs(spacing - distance) <= kSumTolerance * distance ? distance : spacing;
}

// Makes a tree of the positions, and sets `asked` to a sample. Positions are sorted and made
// unique, so that the tree does not depend on the order of the particles, and no query visits a
// million copies of one position.
template <typename Place>
void Sample(std::vector<Place>& positions, std::vector<Place>& asked) {
  ParallelSort(std::span(positions), InDimension<Place>::IsBefore);
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  BuildTree(std::span(positions));
  const std::uint64_t stride = std::max<std::size_t>(1, positions.size() / kSampleSize);
  asked.clear();
  for (const Place& position : positions) {
    if (HashOf(position) % stride == 0) asked.push_back(position);
  }
}

// The median distance of the sampled particles to their nearest neighbour, without spray. Leaves
// these distances in `distances`. Empty if there is none.
template <typename Place>
std::optional<double> NearestDistance(std::span<const Place> tree, std::span<const Place> asked,
                                      std::vector<double>& distances) {
  distances.resize(asked.size());
  ParallelFor(asked.size(), [&](std::size_t k) {
    Nearest nearest;
    GatherNearest(tree, asked[k], nearest);
    distances[k] = std::sqrt(nearest.square);
  });
  std::erase(distances, std::numeric_limits<double>::infinity());
  if (distances.empty()) return std::nullopt;
  const double median = MedianOf(distances);
  std::erase_if(distances, [&](double distance) { return distance > kLonelyRatio * median; });
  return MedianOf(distances);
}

// The estimate for `scratch.positions`.
std::optional<SpacingEstimate> EstimateOfPositions(SpacingScratch& scratch) {
  Sample(scratch.positions, scratch.asked);
  const std::span<const Point> tree = scratch.positions, asked = scratch.asked;
  const std::optional<double> nearest = NearestDistance(tree, asked, scratch.distances);
  if (!nearest) return std::nullopt;
  const std::size_t in_company = scratch.distances.size();
  const auto refined = [&](double distance) {
    return RefineSpacing(distance, tree, asked, scratch.weights);
  };
  const double spacing = refined(*nearest);
  const std::optional<double> around = AgreedDistance(tree, asked, in_company, scratch.distances);
  if (!around) return SpacingEstimate{spacing, false};
  // If the spacing is below half the agreed distance, nearest neighbours are pairs.
  const bool is_doubled = 2 * spacing < *around;
  return SpacingEstimate{is_doubled ? refined(*around) : spacing, true};
}

}  // namespace

std::optional<SpacingEstimate> EstimateSpacing(const Frame& frame, Plane plane,
                                               SpacingScratch& scratch) {
  scratch.positions.resize(frame.ParticleCount());
  VisitPositions(frame, plane, [&](const auto& reader) {
    for (std::size_t k = 0; k < scratch.positions.size(); ++k) scratch.positions[k] = reader[k];
  });
  return EstimateOfPositions(scratch);
}

std::optional<double> EstimateSpacing(const Frame& frame) {
  const bool is_in_space = frame.components == 3;
  std::vector<Point> in_plane;
  std::vector<Vec3> in_space;
  std::visit(
      [&](const auto numbers) {
        for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
          const auto at = numbers.subspan(frame.components * k, frame.components);
          if (!std::ranges::all_of(at, [](double x) { return std::isfinite(x); })) continue;
          if (is_in_space) {
            in_space.push_back({double{at[0]}, double{at[1]}, double{at[2]}});
          } else {
            in_plane.push_back({double{at[0]}, double{at[1]}});
          }
        }
      },
      frame.positions);
  SpacingScratch scratch;
  if (!is_in_space) {
    scratch.positions = std::move(in_plane);
    const auto estimate = EstimateOfPositions(scratch);
    return estimate ? std::optional(estimate->spacing) : std::nullopt;
  }
  std::vector<Vec3> sampled;
  Sample(in_space, sampled);
  const std::span<const Vec3> tree = in_space, asked = sampled;
  const std::optional<double> nearest = NearestDistance(tree, asked, scratch.distances);
  if (!nearest) return std::nullopt;
  return RefineSpacing(*nearest, tree, asked, scratch.weights);
}

}  // namespace partiemc
