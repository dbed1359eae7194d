#include "cut/line_cut.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace partiemc {
namespace {

double Across(const AxisLine& line, const Point& point) {
  return line.axis == 0 ? point.x : point.y;
}

bool IsKept(const AxisLine& line, const Point& point) {
  return (Across(line, point) > line.at) == line.keeps_above;
}

// The point where the segment from a to b crosses the line. Has `is_cut` and `is_wet` of a, because
// the rest of the segment begins here.
LoopPoint CrossingOf(const AxisLine& line, const LoopPoint& a, const LoopPoint& b) {
  const bool is_reversed = line.is_shared && Across(line, b.at) < Across(line, a.at);
  const Point& first = is_reversed ? b.at : a.at;
  const Point& second = is_reversed ? a.at : b.at;
  const double t = (line.at - Across(line, first)) / (Across(line, second) - Across(line, first));
  const auto between = [&](double from, double to) {
    return std::clamp(from + t * (to - from), std::min(from, to), std::max(from, to));
  };
  LoopPoint point = a;
  point.at = line.axis == 0 ? Point{line.at, between(first.y, second.y)}
                            : Point{between(first.x, second.x), line.at};
  point.root = point.at;
  point.contact_angle = LoopPoint::kNoContact;
  const auto s = static_cast<float>(is_reversed ? 1 - t : t);
  const float x = a.normal_x + s * (b.normal_x - a.normal_x);
  const float y = a.normal_y + s * (b.normal_y - a.normal_y);
  const float length = std::sqrt(x * x + y * y);
  if (length > 0) {
    point.normal_x = x / length;
    point.normal_y = y / length;
  }
  return point;
}

// Divides a loop that crosses the line into chains, each from a crossing where the loop enters the
// kept side to the next crossing.
void AddChains(const AxisLine& line, std::span<const LoopPoint> loop, std::uint32_t outer,
               LineCutScratch& s) {
  const std::size_t count = loop.size();
  const auto at = [&](std::size_t k) -> const LoopPoint& { return loop[k % count]; };
  std::size_t start = 0;
  while (IsKept(line, at(start + count - 1).at) || !IsKept(line, at(start).at)) ++start;
  for (std::size_t k = start; k < start + count; ++k) {
    const LoopPoint& before = at(k + count - 1);
    const LoopPoint& point = at(k);
    const bool was_kept = IsKept(line, before.at), is_kept = IsKept(line, point.at);
    const auto number = static_cast<std::uint32_t>(s.chains.size());
    if (was_kept != is_kept) {
      LoopPoint crossing = CrossingOf(line, before, point);
      if (was_kept) {
        crossing.is_cut = true;
        crossing.is_wet = false;
      }
      const double along = line.axis == 0 ? crossing.at.y : crossing.at.x;
      s.crossings.push_back({along, was_kept ? number - 1 : number, is_kept});
      if (is_kept) {
        s.chains.push_back({static_cast<std::uint32_t>(s.points.size()), 0, outer, kNoSource});
      }
      s.points.push_back(crossing);
      if (was_kept) s.chains.back().last = static_cast<std::uint32_t>(s.points.size());
    }
    if (is_kept) s.points.push_back(point);
  }
}

// Sets Chain::next of all chains. Returns false if the order of the crossings is unknown.
bool LinkChains(const AxisLine& line, LineCutScratch& s) {
  std::ranges::sort(s.crossings, [](const auto& a, const auto& b) {
    return a.along != b.along ? a.along < b.along : a.chain < b.chain;
  });
  // The inside is on the left of a chain. If the side x > at is kept, a chain leaves it towards -x,
  // so the inside is below. The stretch inside then begins with an entry.
  const bool begins_with_entry = (line.axis == 0) == line.keeps_above;
  for (std::size_t k = 0; k + 1 < s.crossings.size(); ++k) {
    if (s.crossings[k].along == s.crossings[k + 1].along) return false;
  }
  for (std::size_t k = 0; k + 1 < s.crossings.size(); k += 2) {
    const auto& low = s.crossings[k];
    const auto& high = s.crossings[k + 1];
    if (low.is_entry != begins_with_entry || high.is_entry == begins_with_entry) return false;
    const auto& entry = low.is_entry ? low : high;
    const auto& exit = low.is_entry ? high : low;
    s.chains[exit.chain].next = entry.chain;
  }
  return true;
}

// Appends the loops that the chains form.
void AppendLoops(LineCutScratch& s, Loops& kept) {
  for (std::uint32_t start = 0; start < s.chains.size(); ++start) {
    if (s.chains[start].next == kNoSource) continue;
    const auto first = static_cast<std::uint32_t>(kept.points.size());
    std::uint32_t chain = start;
    while (s.chains[chain].next != kNoSource) {
      kept.points.insert(kept.points.end(), s.points.begin() + s.chains[chain].first,
                         s.points.begin() + s.chains[chain].last);
      chain = std::exchange(s.chains[chain].next, kNoSource);
    }
    kept.loops.push_back({.first = first,
                          .last = static_cast<std::uint32_t>(kept.points.size()),
                          .outer = s.chains[start].outer});
  }
}

}  // namespace

bool CutAtLine(const AxisLine& line, const Loops& loops, LineCutScratch& s, Loops& kept) {
  s.points.clear();
  s.chains.clear();
  s.crossings.clear();
  for (const Loops::Loop& loop : loops.loops) {
    const auto points = std::span(loops.points).subspan(loop.first, loop.last - loop.first);
    std::size_t inside = 0;
    for (const LoopPoint& point : points) {
      if (Across(line, point.at) == line.at) return false;
      inside += IsKept(line, point.at) ? 1 : 0;
    }
    if (inside == 0) continue;
    if (inside < points.size()) {
      AddChains(line, points, loop.outer, s);
      continue;
    }
    Loops::Loop whole = loop;
    whole.first = static_cast<std::uint32_t>(kept.points.size());
    kept.points.insert(kept.points.end(), points.begin(), points.end());
    whole.last = static_cast<std::uint32_t>(kept.points.size());
    kept.loops.push_back(whole);
  }
  if (!LinkChains(line, s)) return false;
  AppendLoops(s, kept);
  return true;
}

}  // namespace partiemc
