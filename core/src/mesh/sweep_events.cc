#include "mesh/sweep_events.h"

#include <algorithm>

#include "base/predicates.h"

namespace partiemc {
namespace {

bool ComesFirst(const SweepEvent& a, const SweepEvent& b) {
  if (a.point == b.point) return a.index < b.index;
  return SweepsBefore(a.point, b.point);
}

/// Divides the range of y into equal buckets. Every operation rounds monotonically, so a point with
/// a larger y is never in a lower bucket.
class Buckets {
 public:
  /// Requires: there are events.
  explicit Buckets(std::span<const SweepEvent> events) : last_(events.size() - 1) {
    double highest = lowest_ = events.front().point.y;
    for (const SweepEvent& event : events) {
      lowest_ = std::min(lowest_, event.point.y);
      highest = std::max(highest, event.point.y);
    }
    if (highest > lowest_) per_unit_ = static_cast<double>(last_) / (highest - lowest_);
  }

  std::size_t size() const { return last_ + 1; }
  std::size_t Of(const SweepEvent& event) const {
    const double bucket = (event.point.y - lowest_) * per_unit_;
    return std::min(static_cast<std::size_t>(bucket), last_);
  }

 private:
  std::size_t last_;
  double lowest_ = 0, per_unit_ = 0;
};

}  // namespace

bool SweepEvents::Collect(std::span<const double> points,
                          std::span<const std::uint32_t> loop_points,
                          std::span<const std::uint32_t> loop_offsets) {
  events_.clear();
  if (!List(points, loop_points, loop_offsets)) {
    events_.clear();
    return false;
  }
  if (!events_.empty()) Sort();
  return true;
}

bool SweepEvents::List(std::span<const double> points, std::span<const std::uint32_t> loop_points,
                       std::span<const std::uint32_t> loop_offsets) {
  if (loop_offsets.empty()) return loop_points.empty();
  if (loop_offsets.front() != 0 || loop_offsets.back() != loop_points.size()) return false;
  for (std::size_t loop = 0; loop + 1 < loop_offsets.size(); ++loop) {
    const std::size_t begin = loop_offsets[loop];
    const std::size_t end = loop_offsets[loop + 1];
    // Decreasing offsets are found here, before an offset beyond the last one is used.
    if (end > loop_points.size() || end < begin + 3) return false;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t index = loop_points[i];
      if (index >= points.size() / 2) return false;
      const Point point = PointAt(points, index);
      if (!InPredicateDomain(point.x) || !InPredicateDomain(point.y)) return false;
      events_.push_back({point, index, loop_points[i == begin ? end - 1 : i - 1],
                         loop_points[i + 1 == end ? begin : i + 1]});
    }
  }
  return true;
}

/// Bucket sort by y, with as many buckets as events; then sorts each bucket.
void SweepEvents::Sort() {
  const Buckets buckets(events_);
  ends_.assign(buckets.size() + 1, 0);
  for (const SweepEvent& event : events_) ++ends_[buckets.Of(event) + 1];
  for (std::size_t k = 1; k < ends_.size(); ++k) ends_[k] += ends_[k - 1];
  dealt_.resize(events_.size());
  // ends_[k] is first the start of bucket k. Placing the events of the bucket moves it to the end.
  for (const SweepEvent& event : events_) dealt_[ends_[buckets.Of(event)]++] = event;
  std::size_t begin = 0;
  for (const std::uint32_t end : ends_) {
    if (end - begin > 1) std::sort(dealt_.begin() + begin, dealt_.begin() + end, ComesFirst);
    begin = end;
  }
  events_.swap(dealt_);
}

}  // namespace partiemc
