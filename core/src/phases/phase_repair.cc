#include "phases/phase_repair.h"

#include <algorithm>
#include <numeric>

#include "base/cancellation.h"
#include "vertices/measure.h"

namespace partiemc {
namespace {

constexpr int kMostRounds = 24;

// The rings of the body or of a phase, by numbers of shared points.
struct Outline {
  std::span<const std::uint32_t> numbers;  // Empty: point k has the number k.
  std::span<const std::uint32_t> offsets;
  std::span<const std::uint32_t> outer_of;

  std::uint32_t NumberOf(std::uint32_t point) const {
    return numbers.empty() ? point : numbers[point];
  }
};

struct Repair {
  std::span<const double> roots;
  std::span<const std::uint8_t> near_walls;
  PhaseRepairScratch& s;
  std::span<double> points;
  bool has_touching = false, has_misplaced = false;

  void Gather(const Outline& outline) {
    s.gathered.clear();
    for (std::uint32_t k = 0; k < outline.offsets.back(); ++k) {
      const std::uint32_t number = outline.NumberOf(k);
      s.gathered.push_back(points[2 * std::size_t{number}]);
      s.gathered.push_back(points[2 * std::size_t{number} + 1]);
    }
  }

  // Marks both ends of a segment and the points before and after it.
  void MarkSegment(const Outline& outline, std::uint32_t segment) {
    const auto after = std::ranges::upper_bound(outline.offsets, segment);
    const std::uint32_t begin = *(after - 1), count = *after - begin;
    for (std::uint32_t k = 0; k < 4; ++k) {
      s.is_marked[outline.NumberOf(begin + (segment - begin + count - 1 + k) % count)] = 1;
    }
  }

  void MarkTouching(const Outline& outline) {
    Gather(outline);
    if (CountTouchingPairs(s.gathered, outline.offsets, s.pairs) == 0) return;
    has_touching = true;
    for (const auto& [first, second] : s.pairs.pairs) {
      MarkSegment(outline, first);
      MarkSegment(outline, second);
    }
  }

  bool IsMisplaced(const Outline& outline) {
    Gather(outline);
    s.depths.Find(s.gathered, outline.offsets);
    for (std::size_t ring = 0; ring + 1 < outline.offsets.size(); ++ring) {
      const bool is_hole = outline.outer_of[ring] != kNoRing;
      const std::span<const double> of =
          std::span(s.gathered)
              .subspan(2 * std::size_t{outline.offsets[ring]},
                       2 * std::size_t{outline.offsets[ring + 1] - outline.offsets[ring]});
      if ((MeasureRing(of).area < 0) != is_hole) return true;
      if (s.depths.DepthOf(ring) != (is_hole ? 1 : 0)) return true;
    }
    return false;
  }

  void MarkMisplaced(const Outline& outline) {
    if (!IsMisplaced(outline)) return;
    has_misplaced = true;
    for (std::uint32_t k = 0; k < outline.offsets.back(); ++k) s.is_marked[outline.NumberOf(k)] = 1;
  }

  // Returns whether any point moved.
  bool MovePoints(bool all_the_way) {
    bool has_moved = false;
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (!s.is_marked[k / 2] || points[k] == roots[k]) continue;
      const bool goes_back = all_the_way || (!near_walls.empty() && near_walls[k / 2] != 0);
      points[k] = goes_back ? roots[k] : (points[k] + roots[k]) / 2;
      has_moved = true;
    }
    return has_moved;
  }
};

}  // namespace

bool RepairPhases(const Rings& body, std::span<const PhaseRings> phases,
                  std::span<const double> roots, std::span<const std::uint8_t> near_walls,
                  PhaseRepairScratch& scratch, std::span<double> points) {
  const auto for_each_outline = [&](auto visit) {
    visit(Outline{{}, body.offsets, body.outer_of});
    for (const PhaseRings& phase : phases) {
      visit(Outline{phase.points, phase.offsets, phase.topology.outer_of});
    }
  };
  for (int round = 0;; ++round) {
    ThrowIfCancelled();
    Repair repair{roots, near_walls, scratch, points};
    scratch.is_marked.assign(points.size() / 2, 0);
    for_each_outline([&](const Outline& outline) { repair.MarkTouching(outline); });
    if (!repair.has_touching) {
      for_each_outline([&](const Outline& outline) { repair.MarkMisplaced(outline); });
      if (!repair.has_misplaced) return true;
    }
    const bool all_the_way = repair.has_misplaced || round >= kHalfWayRounds;
    if (round < kMostRounds && repair.MovePoints(all_the_way)) continue;
    std::ranges::fill(scratch.is_marked, std::uint8_t{1});
    if (!repair.MovePoints(true)) return false;
  }
}

}  // namespace partiemc
