#include "frame/spacing.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "frame/near_ring.h"

namespace partiemc {
namespace {

// Approximate size of the sample: the median distance in the sample is within a percent of the
// median distance of all particles.
constexpr std::size_t kSampleSize = 1 << 14;

// A particle is spray if its nearest neighbour is farther away than this number of medians. Inside
// bodies, distances stay below two medians.
constexpr double kLonelyRatio = 4;

// Radius of the kernel sums, in spacings. Each round uses the spacing that the round before found;
// thinned particles need the third round.
constexpr double kDensityRadius = 3;
constexpr int kDensityRounds = 3;
// A test point counts if particles surround it: if the weighted mean of the particles lies within
// kMaxImbalance radii of the point, and their weighted mean square distance, in squared radii, lies
// between kMinSpread and kMaxSpread; a filled disk has 0.2.
constexpr double kMaxImbalance = 0.15;
constexpr double kMinSpread = 0.17;
constexpr double kMaxSpread = 0.25;
// With fewer such points, bodies are too thin or too small for a density, and the spacing is the
// median distance.
constexpr std::size_t kMinFilledPoints = 32;
// Relative error of the kernel sums in small or thin bodies. If the spacing by density is closer to
// the median distance than this error, the median distance is the better estimate; on lattices it
// is exact.
constexpr double kSumTolerance = 0.05;
constexpr double kQuarterPi = 0.78539816339744830962;

// Offsets of the test points from the sampled particles, in kernel radii. At distance 1 the
// particle itself adds nothing to the kernel sum, so the mean of the sums is unbiased for any
// arrangement.
constexpr Point kDirections[] = {{1, 0},       {0.8, 0.6},  {0.6, 0.8},  {0, 1},
                                 {-0.6, 0.8},  {-0.8, 0.6}, {-1, 0},     {-0.8, -0.6},
                                 {-0.6, -0.8}, {0, -1},     {0.6, -0.8}, {0.8, -0.6}};

double Along(const Point& position, int axis) { return axis == 0 ? position.x : position.y; }

// Below this number of positions a task costs more than it saves.
constexpr std::size_t kMinParallel = 1 << 13;

// Orders positions into an implicit balanced k-d tree: the median of a range splits it.
void BuildTree(std::span<Point> positions, int axis) {
  if (positions.size() < 2) return;
  const std::size_t middle = positions.size() / 2;
  std::nth_element(
      positions.begin(), positions.begin() + middle, positions.end(),
      [axis](const Point& a, const Point& b) { return Along(a, axis) < Along(b, axis); });
  const auto build_lower = [=] { BuildTree(positions.first(middle), 1 - axis); };
  const auto build_upper = [=] { BuildTree(positions.subspan(middle + 1), 1 - axis); };
  if (positions.size() >= kMinParallel) {
    ParallelInvoke(build_lower, build_upper);
  } else {
    build_lower();
    build_upper();
  }
}

// Collects offsets and keeps the squared distance of the nearest other position.
struct Nearest {
  double square = std::numeric_limits<double>::infinity();

  void Add(double dx, double dy) {
    const double next = dx * dx + dy * dy;
    if (next > 0) square = std::min(square, next);
  }
  double reach_square() const { return square; }
};

// Adds the offsets of positions near `query` to `near` (Nearest or NearRing). Skips branches of the
// tree beyond the reach of `near`, which shrinks with each position. If distances are equal, the
// order of the tree decides.
template <typename Near>
void GatherNearest(std::span<const Point> tree, const Point& query, int axis, Near& near) {
  if (tree.empty()) return;
  const std::size_t middle = tree.size() / 2;
  near.Add(tree[middle].x - query.x, tree[middle].y - query.y);
  const double across = Along(query, axis) - Along(tree[middle], axis);
  const auto lower = tree.first(middle);
  const auto upper = tree.subspan(middle + 1);
  GatherNearest(across < 0 ? lower : upper, query, 1 - axis, near);
  if (across * across < near.reach_square()) {
    GatherNearest(across < 0 ? upper : lower, query, 1 - axis, near);
  }
}

// Calls visit(dx, dy) for the positions closer than `radius` to a point, in the order of the tree.
template <typename Visit>
void ForEachWithin(std::span<const Point> tree, const Point& point, int axis, double radius,
                   const Visit& visit) {
  if (tree.empty()) return;
  const std::size_t middle = tree.size() / 2;
  const double across = Along(point, axis) - Along(tree[middle], axis);
  if (across <= radius) ForEachWithin(tree.first(middle), point, 1 - axis, radius, visit);
  const double dx = tree[middle].x - point.x;
  const double dy = tree[middle].y - point.y;
  if (dx * dx + dy * dy < radius * radius) visit(dx, dy);
  if (across >= -radius) ForEachWithin(tree.subspan(middle + 1), point, 1 - axis, radius, visit);
}

// The kernel sum at a point; 0 if particles do not surround the point.
double FilledWeight(std::span<const Point> tree, const Point& point, double radius) {
  const double inverse = 1 / radius;
  double weight = 0, moment_x = 0, moment_y = 0, spread = 0;  // In radii.
  ForEachWithin(tree, point, 0, radius, [&](double dx, double dy) {
    const double x = dx * inverse;
    const double y = dy * inverse;
    const double square = x * x + y * y;
    const double t = 1 - square;
    const double k = t * t * t;
    weight += k;
    moment_x += k * x;
    moment_y += k * y;
    spread += k * square;
  });
  const double reach = kMaxImbalance * weight;
  const bool is_filled = moment_x * moment_x + moment_y * moment_y <= reach * reach &&
                         spread >= kMinSpread * weight && spread <= kMaxSpread * weight;
  return is_filled ? weight : 0;
}

// The spacing that follows from the density inside bodies. Empty if too few test points are
// surrounded.
std::optional<double> SpacingOfDensity(std::span<const Point> tree, std::span<const Point> asked,
                                       double radius, std::vector<double>& weights) {
  weights.resize(asked.size());
  ParallelFor(asked.size(), [&](std::size_t k) {
    const Point& direction = kDirections[k % std::size(kDirections)];
    const Point point{asked[k].x + radius * direction.x, asked[k].y + radius * direction.y};
    weights[k] = FilledWeight(tree, point, radius);
  });
  std::erase(weights, 0.0);
  if (weights.size() < kMinFilledPoints) return std::nullopt;
  double sum = 0;
  for (const double weight : weights) sum += weight;
  // The kernel integrates to pi R^2 / 4 over the plane.
  return radius * std::sqrt(kQuarterPi * static_cast<double>(weights.size()) / sum);
}

std::uint64_t HashOf(const Point& position) {
  // + 0.0 maps -0 to 0.
  std::uint64_t hash = std::bit_cast<std::uint64_t>(position.x + 0.0) * 0x9e3779b97f4a7c15u;
  hash ^= hash >> 32;
  hash = (hash ^ std::bit_cast<std::uint64_t>(position.y + 0.0)) * 0xc2b2ae3d27d4eb4fu;
  return hash ^ hash >> 29;
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
    NearRing ring;
    GatherNearest(tree, asked[k], 0, ring);
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
double RefineSpacing(double distance, SpacingScratch& scratch) {
  double spacing = distance;
  for (int round = 0; round < kDensityRounds; ++round) {
    const std::optional<double> dense = SpacingOfDensity(scratch.positions, scratch.asked,
                                                         kDensityRadius * spacing, scratch.weights);
    if (!dense) break;
    spacing = *dense;
  }
  return std::abs(spacing - distance) <= kSumTolerance * distance ? distance : spacing;
}

}  // namespace

std::optional<SpacingEstimate> EstimateSpacing(const Frame& frame, Plane plane,
                                               SpacingScratch& scratch) {
  const std::size_t count = frame.ParticleCount();
  auto& [positions, asked, distances, weights] = scratch;
  positions.resize(count);
  VisitPositions(frame, plane, [&](const auto& reader) {
    for (std::size_t k = 0; k < count; ++k) scratch.positions[k] = reader[k];
  });
  // Positions are sorted and made unique, so that the tree does not depend on the order of the
  // particles, and no query visits a million copies of one position.
  ParallelSort(std::span(positions),
               [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  const auto same = [](const auto& a, const auto& b) { return a.x == b.x && a.y == b.y; };
  positions.erase(std::unique(positions.begin(), positions.end(), same), positions.end());
  BuildTree(positions, 0);

  const std::uint64_t stride = std::max<std::size_t>(1, positions.size() / kSampleSize);
  asked.clear();
  for (const Point& position : positions) {
    if (HashOf(position) % stride == 0) asked.push_back(position);
  }
  distances.resize(asked.size());
  ParallelFor(asked.size(), [&](std::size_t k) {
    Nearest nearest;
    GatherNearest<Nearest>(scratch.positions, scratch.asked[k], 0, nearest);
    scratch.distances[k] = std::sqrt(nearest.square);
  });
  std::erase(distances, std::numeric_limits<double>::infinity());
  if (distances.empty()) return std::nullopt;
  const double median = MedianOf(distances);
  std::erase_if(distances, [&](double distance) { return distance > kLonelyRatio * median; });
  const double spacing = RefineSpacing(MedianOf(distances), scratch);
  const std::optional<double> around =
      AgreedDistance(positions, asked, distances.size(), scratch.distances);
  if (!around) return SpacingEstimate{spacing, false};
  // Nearest neighbours closer than half the agreed distance are pairs.
  const bool is_doubled = 2 * spacing < *around;
  return SpacingEstimate{is_doubled ? RefineSpacing(*around, scratch) : spacing, true};
}

}  // namespace partiemc
