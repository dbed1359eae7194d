#include "vertices/ring_depths.h"

#include <algorithm>

#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/predicates.h"

namespace partiemc {

void RingDepths::CollectTurns(std::span<const std::uint32_t> offsets) {
  turns_.clear();
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    const std::uint32_t first = offsets[ring], last = offsets[ring + 1];
    const std::size_t before = turns_.size();
    std::size_t lowest = before;
    Point point = PointAt(points_, last - 1);
    bool rises = last - first > 1 && SweepsBefore(PointAt(points_, last - 2), point);
    for (std::uint32_t next = first; next < last; ++next) {
      const Point to = PointAt(points_, next);
      const bool goes_on_rising = SweepsBefore(point, to);
      if (goes_on_rising != rises) {
        const std::uint32_t index = (next == first ? last : next) - 1;
        turns_.push_back({point, index, ring, goes_on_rising, false});
        if (goes_on_rising &&
            (!turns_[lowest].is_low || SweepsBefore(point, turns_[lowest].point))) {
          lowest = turns_.size() - 1;
        }
      }
      rises = goes_on_rising;
      point = to;
    }
    if (turns_.size() > before) turns_[lowest].is_lowest = true;
  }
  ParallelSort(std::span(turns_),
               [](const Turn& a, const Turn& b) { return SweepsBefore(a.point, b.point); });
}

std::uint32_t RingDepths::Above(const Chain& chain) {
  if (chain.is_forward) return chain.at + 1 == chain.last ? chain.first : chain.at + 1;
  return (chain.at == chain.first ? chain.last : chain.at) - 1;
}

// Whether a chain on the sweep line runs left of `point`. Advances the chain to the point's height.
bool RingDepths::RunsLeftOf(std::uint32_t chain, const Point& point) {
  Chain& c = chains_[chain];
  std::uint32_t above = Above(c);
  while (SweepsBefore(PointAt(points_, above), point)) {
    c.at = above;
    above = Above(c);
  }
  return Orientation(PointAt(points_, c.at), PointAt(points_, above), point) < 0;
}

void RingDepths::Begin(const Turn& turn, std::span<const std::uint32_t> offsets) {
  const SweepStatus::Cursor right =
      status_.FindFirstNot([&](std::uint32_t chain) { return RunsLeftOf(chain, turn.point); });
  const std::int32_t depth = status_.IsEnd(right) ? 0 : chains_[status_.At(right)].depth;
  const std::uint32_t first = offsets[turn.ring], last = offsets[turn.ring + 1];
  Chain on{turn.ring, turn.index, first, last, true, depth};
  Chain back{turn.ring, turn.index, first, last, false, depth};
  // If the forward chain is on the right, the ring winds counter-clockwise around the region
  // between the two chains.
  const bool on_is_right =
      Orientation(turn.point, PointAt(points_, Above(on)), PointAt(points_, Above(back))) > 0;
  if (turn.is_lowest) {
    Ring& ring = rings_[turn.ring];
    ring = {depth, kNoRing, on_is_right};
    if (!status_.IsEnd(right)) {
      const Chain& beside = chains_[status_.At(right)];
      const Ring& other = rings_[beside.ring];  // Known: its lowest point is below.
      ring.around = beside.is_forward == other.is_counter_clockwise ? beside.ring : other.around;
    }
  }
  (on_is_right ? on : back).depth += on_is_right ? 1 : -1;
  const auto add = [&](const Chain& chain) {
    if (unused_.empty()) {
      unused_.push_back(static_cast<std::uint32_t>(chains_.size()));
      chains_.emplace_back();
    }
    const std::uint32_t id = unused_.back();
    unused_.pop_back();
    chains_[id] = chain;
    return id;
  };
  const SweepStatus::Cursor behind = status_.Insert(right, add(on_is_right ? back : on));
  status_.Insert(behind, add(on_is_right ? on : back));
}

void RingDepths::End(const Turn& turn) {
  SweepStatus::Cursor cursor =
      status_.FindFirstNot([&](std::uint32_t chain) { return RunsLeftOf(chain, turn.point); });
  for (int side = 0; side < 2 && !status_.IsEnd(cursor); ++side) {
    unused_.push_back(status_.At(cursor));
    cursor = status_.Erase(cursor);
  }
}

void RingDepths::Find(std::span<const double> points, std::span<const std::uint32_t> offsets) {
  points_ = points;
  rings_.assign(offsets.empty() ? 0 : offsets.size() - 1, {});
  chains_.clear();
  unused_.clear();
  status_.Clear();
  CollectTurns(offsets);
  for (const Turn& turn : turns_) {
    ThrowIfCancelled();
    if (turn.is_low) {
      Begin(turn, offsets);
    } else {
      End(turn);
    }
  }
}

}  // namespace partiemc
