#include "check/ring_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "base/predicates.h"
#include "partiemc/status.h"
#include "vertices/intersections.h"
#include "vertices/ring_depths.h"

namespace partiemc {
namespace {

// --- R1 -----------------------------------------------------------------------------------------

absl::Status CheckRingArrays(const Rings& rings) {
  const std::size_t count = rings.RingCount();
  if (rings.points.size() % 2 != 0) {
    return Broken("R1: ring points have ", rings.points.size(), " coordinates, an odd number");
  }
  if (rings.offsets.size() != count + 1 && !(count == 0 && rings.offsets.empty())) {
    return Broken("R1: ", rings.offsets.size(), " ring offsets for ", count, " rings");
  }
  const std::size_t first = rings.offsets.empty() ? 0 : rings.offsets.front();
  const std::size_t last = rings.offsets.empty() ? 0 : rings.offsets.back();
  if (first != 0 || last != rings.PointCount()) {
    return Broken("R1: ring offsets run from ", first, " to ", last, ", not from 0 to ",
                  rings.PointCount());
  }
  if (!std::is_sorted(rings.offsets.begin(), rings.offsets.end())) {
    return Broken("R1: ring offsets descend");
  }
  if (!rings.measures.empty() && rings.measures.size() != count) {
    return Broken("R1: measures of ", rings.measures.size(), " rings for ", count);
  }
  if (!rings.normals.empty() && rings.normals.size() != rings.points.size()) {
    return Broken("R1: ", rings.normals.size(), " components of normals for ", rings.points.size(),
                  " coordinates");
  }
  return absl::OkStatus();
}

/// Index of the ring that contains `point`.
std::size_t RingOf(const Rings& rings, std::size_t point) {
  const auto after = std::upper_bound(rings.offsets.begin(), rings.offsets.end(), point);
  return static_cast<std::size_t>(after - rings.offsets.begin()) - 1;
}

absl::Status CheckR1(const Rings& rings) {
  if (absl::Status status = CheckRingArrays(rings); !status.ok()) return status;
  if (absl::Status status = CheckPoints("R1", rings.points); !status.ok()) return status;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::size_t count = rings.offsets[ring + 1] - rings.offsets[ring];
    if (count < 3) return Broken("R1: ring ", ring, " has ", count, " points");
  }
  const auto point_at = [&](std::size_t i) { return PointAt(rings.points, i); };
  std::vector<std::size_t> order(rings.PointCount());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (point_at(a) == point_at(b)) return a < b;
    return SweepsBefore(point_at(a), point_at(b));
  });
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (point_at(order[i - 1]) != point_at(order[i])) continue;
    // Equal points of different rings are not checked here: the rings touch, which R2 reports.
    const std::size_t ring = RingOf(rings, order[i]);
    if (RingOf(rings, order[i - 1]) != ring) continue;
    return Broken("R1: ring ", ring, " has points ", order[i - 1], " and ", order[i],
                  " at the same place");
  }
  return absl::OkStatus();
}

// --- R2, R3 -------------------------------------------------------------------------------------

absl::Status CheckR2(const Rings& rings) {
  TouchingPairsBuffers buffers;
  const std::size_t count = CountTouchingPairs(rings.points, rings.offsets, buffers);
  if (count == 0) return absl::OkStatus();
  const auto [first, second] = std::minmax(buffers.pairs[0].first, buffers.pairs[0].second);
  return Broken("R2: ", count, " pairs of segments cross or touch, one of them those from point ",
                first, " of ring ", RingOf(rings, first), " and from point ", second, " of ring ",
                RingOf(rings, second));
}

/// +1 for a counter-clockwise ring, -1 for a clockwise ring, by the turn at the lowest point.
/// Requires: R1 and R2, so that this turn is not flat.
int RingOrientation(std::span<const double> ring) {
  const std::size_t count = ring.size() / 2;
  std::size_t lowest = 0;
  for (std::size_t i = 1; i < count; ++i) {
    if (SweepsBefore(PointAt(ring, i), PointAt(ring, lowest))) lowest = i;
  }
  return Orientation(PointAt(ring, (lowest + count - 1) % count), PointAt(ring, lowest),
                     PointAt(ring, (lowest + 1) % count));
}

absl::Status CheckR3(const Rings& rings) {
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    const int orientation = RingOrientation(rings.RingPoints(ring));
    if (orientation == (is_outer ? 1 : -1)) continue;
    return Broken("R3: ring ", ring,
                  is_outer ? " is an outer ring, but runs " : " is a hole, but runs ",
                  orientation > 0 ? "counter-clockwise" : "clockwise");
  }
  return absl::OkStatus();
}

// --- R4 -----------------------------------------------------------------------------------------

/// Checks that each hole lies directly inside the outer ring that `outer_of` gives, and that each
/// outer ring lies directly inside a hole or inside no ring. Requires: R1-R3.
absl::Status CheckR4(const Rings& rings) {
  const auto is_hole = [&](std::uint32_t ring) { return rings.outer_of[ring] != kNoRing; };
  RingDepths nesting;
  nesting.Find(rings.points, rings.offsets);
  for (std::uint32_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t outer = rings.outer_of[ring];
    const std::uint32_t around = nesting.AroundOf(ring);
    const std::string where = around == kNoRing ? "nothing" : absl::StrCat("ring ", around);
    if (!is_hole(ring)) {
      if (around == kNoRing || is_hole(around)) continue;
      return Broken("R4: ring ", ring, ", an outer ring, lies in ", where, ", which is no hole");
    }
    if (outer >= rings.RingCount() || is_hole(outer)) {
      return Broken("R4: hole ", ring, " names ring ", outer, ", which is no outer ring");
    }
    if (around == outer) continue;
    return Broken("R4: ring ", ring, ", a hole, lies in ", where, ", but names ring ", outer);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckPoints(absl::string_view guarantee, std::span<const double> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::isfinite(points[i]) && InPredicateDomain(points[i])) continue;
    return Broken(guarantee, ": point ", i / 2, " has coordinate ", points[i],
                  ", which is not finite or outside the range of exact arithmetic");
  }
  return absl::OkStatus();
}

namespace {

absl::Status CheckContacts(const Rings& rings) {
  if (rings.contact_angles.size() != rings.contacts.size()) {
    return Broken("contacts: ", rings.contact_angles.size(), " angles for ", rings.contacts.size(),
                  " contacts");
  }
  for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
    const std::uint32_t point = rings.contacts[k];
    if (point >= rings.PointCount() || (k > 0 && point <= rings.contacts[k - 1])) {
      return Broken("contacts: point ", point, " is not in order, or beyond the ",
                    rings.PointCount(), " points");
    }
    constexpr float kTurn = 6.2831855f;  // 2 pi.
    if (const float angle = rings.contact_angles[k]; !(angle >= 0 && angle <= kTurn)) {
      return Broken("contacts: the angle ", ShortestNumber(angle), " at point ", point,
                    " is not in [0, 2 pi]");
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckRings(const Rings& rings) {
  for (const auto check : {CheckR1, CheckR2, CheckR3, CheckR4, CheckContacts}) {
    if (absl::Status status = check(rings); !status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
