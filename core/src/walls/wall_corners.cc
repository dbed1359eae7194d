#include "walls/wall_corners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "base/cancellation.h"
#include "base/point.h"

namespace partiemc {
namespace {

// An arm is a part of the ring on one side of a point. It begins kBegin spacings from the point and
// has kSamples samples, kStep spacings apart.
constexpr double kBegin = 1.5, kStep = .5;
constexpr std::size_t kSamples = 7;
constexpr double kLength = kBegin + kStep * (kSamples - 1);
// The angle by which the ring turns from one arm to the other is at least kLeastTurn, in radians.
// An arm bends by at most kMostBend of this angle.
constexpr double kLeastTurn = .52, kMostBend = 1.0 / 7;
// Farthest corner from the outline, in spacings.
constexpr double kFarthest = 1.5;

using Arm = std::array<Point, kSamples>;

struct Line {
  Point at, direction;
};

// The line of least squares through the samples, in their direction.
Line LineOf(std::span<const Point> samples) {
  Point mean;
  for (const Point& sample : samples) {
    mean.x += sample.x / static_cast<double>(samples.size());
    mean.y += sample.y / static_cast<double>(samples.size());
  }
  double xx = 0, xy = 0, yy = 0;
  for (const Point& sample : samples) {
    const Point from = Minus(sample, mean);
    xx += from.x * from.x;
    xy += from.x * from.y;
    yy += from.y * from.y;
  }
  // The larger axis of the ellipse of the samples.
  const double half = (xx - yy) / 2, root = std::sqrt(half * half + xy * xy);
  Point direction = half > 0 ? Point{half + root, xy} : Point{xy, root - half};
  const double length = Length(direction);
  if (length > 0) direction = Times(direction, 1 / length);
  if (Dot(direction, Minus(samples.back(), samples.front())) < 0) {
    direction = {-direction.x, -direction.y};
  }
  return {mean, direction};
}

// A ring with the lengths up to its points.
class Ring {
 public:
  Ring(std::span<const double> points, std::vector<double>& lengths)
      : points_(points), lengths_(lengths) {
    lengths_.clear();
    double length = 0;
    for (std::size_t k = 0; k < count(); ++k) {
      lengths_.push_back(length);
      const Point step = Minus(At(k + 1), At(k));
      length += std::sqrt(Dot(step, step));
    }
    perimeter_ = length;
  }

  std::size_t count() const { return points_.size() / 2; }
  double perimeter() const { return perimeter_; }
  Point At(std::size_t k) const { return PointAt(points_, k % count()); }
  // The length of the ring from one point to another, by the shorter way. Negative if this way runs
  // against the ring.
  double Between(std::size_t from, std::size_t to) const {
    return std::remainder(lengths_[to] - lengths_[from], perimeter_);
  }

  Point AtLength(double length) const {
    length -= std::floor(length / perimeter_) * perimeter_;
    const auto after = std::ranges::upper_bound(lengths_, length);
    const auto k =
        static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - lengths_.begin(), 1)) - 1;
    const double end = k + 1 < count() ? lengths_[k + 1] : perimeter_;
    const double share = end > lengths_[k] ? (length - lengths_[k]) / (end - lengths_[k]) : 0;
    const Point a = At(k), b = At(k + 1);
    return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
  }

  Arm ArmOf(std::size_t point, double h, int sign) const {
    Arm arm;
    for (std::size_t k = 0; k < kSamples; ++k) {
      arm[k] = AtLength(lengths_[point] + sign * h * (kBegin + kStep * static_cast<double>(k)));
    }
    return arm;
  }

 private:
  const std::span<const double> points_;
  std::vector<double>& lengths_;
  double perimeter_ = 0;
};

// Whether an arm bends too much to be straight beside a turn.
bool IsBent(const Arm& arm, double turn) {
  constexpr std::size_t kHalf = (kSamples + 1) / 2;
  const Line near = LineOf(std::span(arm).first(kHalf));
  const Line far = LineOf(std::span(arm).last(kHalf));
  return AngleBetween(near.direction, far.direction) > kMostBend * turn;
}

std::optional<WallCornerScratch::Corner> CornerAt(const Ring& ring, std::size_t point, double h) {
  const Arm before = ring.ArmOf(point, h, -1), after = ring.ArmOf(point, h, 1);
  const Line a = LineOf(before), b = LineOf(after);
  // Both directions lead away from the point.
  const double turn = AngleBetween({-a.direction.x, -a.direction.y}, b.direction);
  if (turn < kLeastTurn || IsBent(before, turn) || IsBent(after, turn)) return std::nullopt;
  const double divisor = Cross(a.direction, b.direction);
  if (divisor == 0) return std::nullopt;
  const double along = Cross(Minus(b.at, a.at), b.direction) / divisor;
  const Point at{a.at.x + along * a.direction.x, a.at.y + along * a.direction.y};
  const Point from = Minus(at, ring.At(point));
  const double distance = std::sqrt(Dot(from, from));
  if (!(distance < kFarthest * h)) return std::nullopt;
  return WallCornerScratch::Corner{static_cast<std::uint32_t>(point), at, distance};
}

// If successive corners are less than 2 kBegin spacings apart along the ring, keeps only the corner
// nearest to the outline. Compares each corner with the last one kept.
void KeepNearest(const Ring& ring, double h, std::vector<WallCornerScratch::Corner>& corners) {
  const auto are_near = [&](const auto& a, const auto& b) {
    return std::abs(ring.Between(a.point, b.point)) < 2 * kBegin * h;
  };
  std::size_t kept = 0;
  for (const WallCornerScratch::Corner& corner : corners) {
    if (kept == 0 || !are_near(corners[kept - 1], corner)) {
      corners[kept++] = corner;
    } else if (corner.distance < corners[kept - 1].distance) {
      corners[kept - 1] = corner;
    }
  }
  // The last one may be near the first one.
  if (kept > 1 && are_near(corners[kept - 1], corners[0])) {
    if (corners[kept - 1].distance < corners[0].distance) corners[0] = corners[kept - 1];
    --kept;
  }
  corners.resize(kept);
  std::ranges::sort(corners, {}, &WallCornerScratch::Corner::point);
}

// Appends a ring with its corners.
void AddRing(const Ring& ring, double h, const std::vector<WallCornerScratch::Corner>& corners,
             std::vector<double>& points) {
  std::size_t next = 0;  // The first corner at this point or after it.
  for (std::size_t k = 0; k < ring.count(); ++k) {
    if (next < corners.size() && corners[next].point < k) ++next;
    if (next < corners.size() && corners[next].point == k) {
      points.insert(points.end(), {corners[next].at.x, corners[next].at.y});
      continue;
    }
    const auto is_rounded = [&](const WallCornerScratch::Corner& corner) {
      return std::abs(ring.Between(corner.point, k)) < kBegin * h;
    };
    // A point may belong to the corner before it or after it, around the end of the ring.
    const std::size_t count = corners.size();
    if (count > 0 &&
        (is_rounded(corners[next % count]) || is_rounded(corners[(next + count - 1) % count]))) {
      continue;
    }
    points.insert(points.end(), {ring.At(k).x, ring.At(k).y});
  }
}

}  // namespace

void SharpenCorners(double spacing, WallCornerScratch& s, Rings& rings) {
  s.points.clear();
  s.offsets.assign(1, 0);
  for (std::size_t of = 0; of < rings.RingCount(); ++of) {
    ThrowIfCancelled();
    const Ring ring(rings.RingPoints(of), s.lengths);
    s.corners.clear();
    // The arms of a short ring would meet.
    if (ring.perimeter() > 2 * kLength * spacing) {
      for (std::size_t k = 0; k < ring.count(); ++k) {
        if (const auto corner = CornerAt(ring, k, spacing)) s.corners.push_back(*corner);
      }
      KeepNearest(ring, spacing, s.corners);
    }
    AddRing(ring, spacing, s.corners, s.points);
    s.offsets.push_back(static_cast<std::uint32_t>(s.points.size() / 2));
  }
  std::swap(rings.points, s.points);
  std::swap(rings.offsets, s.offsets);
}

}  // namespace partiemc
