#include "vertices/periodic_ring.h"

#include <algorithm>

namespace partiemc {
namespace {

// Windows compare distances in floats. They may include a vertex that is too far by this part of
// the reach.
constexpr double kReachTolerance = 1e-6;

}  // namespace

PeriodicRingSize SizeForWindows(std::span<const Point> ring, std::span<const float> sizes,
                                double reach) {
  const std::size_t count = ring.size();
  const auto length_after = [&](std::size_t k) {
    const std::size_t next = k + 1 == count ? 0 : k + 1;
    const Point& from = ring[k];
    const Point& to = ring[next];
    const std::int32_t length = LengthInUnits(UnitsBetween(RingUnits(from.x), RingUnits(to.x)),
                                              UnitsBetween(RingUnits(from.y), RingUnits(to.y)));
    return std::int64_t{sizes.empty() ? length : LengthInSizes(length, sizes[k], sizes[next])};
  };
  const auto limit =
      static_cast<std::int64_t>(reach * (1 + kReachTolerance) * kRingUnitsPerCell) + 1;
  // Vertices that windows need after the last vertex and before the first one.
  std::size_t after = 0;
  for (std::int64_t distance = length_after(count - 1); distance < limit; ++after) {
    distance += length_after(after % count);
  }
  std::size_t before = 0;
  for (std::int64_t distance = length_after(count - 1); distance < limit; ++before) {
    distance += length_after((2 * count - 2 - before % count) % count);
  }
  return {static_cast<std::uint32_t>(count), static_cast<std::uint32_t>(std::max(after, before))};
}

void PeriodicRings::Allocate() {
  starts_.resize(sizes_.size());
  std::size_t end = 0;
  for (std::size_t ring = 0; ring < sizes_.size(); ++ring) {
    starts_[ring] = end + sizes_[ring].margin;
    end = starts_[ring] + sizes_[ring].count + sizes_[ring].margin;
  }
  for (std::vector<std::int32_t>& array : units_) array.resize(end);
  for (std::vector<float>& array : floats_) array.resize(end);
}

PeriodicRing PeriodicRings::operator[](std::size_t ring) {
  return PeriodicRing::In(
      sizes_[ring], [&](int array) { return units_[array].data() + starts_[ring]; },
      [&](int array) { return floats_[array].data() + starts_[ring]; });
}

}  // namespace partiemc
