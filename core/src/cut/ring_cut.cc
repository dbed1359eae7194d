#include "cut/ring_cut.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/cancellation.h"
#include "vertices/measure.h"

namespace partiemc {
namespace {

// Sides with a smaller coordinate than this, in spacings, move to 0: predicates are not exact for
// tiny coordinates (vertices.cc).
constexpr double kAxisReach = 0x1p-96;
// A step is the sum of both: a part in spacings, and a part in last bits of the farther side.
constexpr double kShiftSpacings = 1e-9, kShiftBits = 8;

bool IsCut(const RingCutInput& input, const RingCutScratch& s, std::size_t ring) {
  return input.percolation.IsCut(input.topology, s.topology_ring[ring]);
}

// Reads Rings::wetted and Rings::contacts along with the points, in their order.
class WallMarks {
 public:
  explicit WallMarks(const Rings& rings) : rings_(rings) {}

  // Sets the marks of a point. Requires: a larger index than in the last call.
  void Set(std::uint32_t index, LoopPoint& point) {
    point.is_wet = Take(rings_.wetted, index, wet_);
    if (Take(rings_.contacts, index, contact_)) {
      point.contact_angle = rings_.contact_angles[contact_];
    }
  }

 private:
  // Whether a list has the index. Moves `at` to the first entry that is not smaller.
  static bool Take(const std::vector<std::uint32_t>& list, std::uint32_t index, std::size_t& at) {
    while (at < list.size() && list[at] < index) ++at;
    return at < list.size() && list[at] == index;
  }

  const Rings& rings_;
  std::size_t wet_ = 0, contact_ = 0;
};

// Renumbers Rings::wetted and Rings::contacts in place while runs of points move to lower indices.
class MovedMarks {
 public:
  explicit MovedMarks(Rings& rings) : rings_(rings) {}

  // The points [first, last) move to `to`. Points between two runs are removed.
  void Move(std::uint32_t first, std::uint32_t last, std::uint32_t to) {
    const auto move = [&](std::vector<std::uint32_t>& list, Range& range, const auto& keep) {
      while (range.read < list.size() && list[range.read] < first) ++range.read;
      for (; range.read < list.size() && list[range.read] < last; ++range.read) {
        keep();
        list[range.written++] = list[range.read] - first + to;
      }
    };
    move(rings_.wetted, wet_, [] {});
    move(rings_.contacts, contact_,
         [&] { rings_.contact_angles[contact_.written] = rings_.contact_angles[contact_.read]; });
  }

  void Finish() {
    rings_.wetted.resize(wet_.written);
    rings_.contacts.resize(contact_.written);
    rings_.contact_angles.resize(contact_.written);
  }

 private:
  struct Range {
    std::size_t read = 0, written = 0;
  };

  Rings& rings_;
  Range wet_, contact_;
};

// Collects the rings to be cut.
void CollectLoops(const RingCutInput& input, const Rings& rings, const PlacedVertices& placed,
                  RingCutScratch& s) {
  s.loops.Clear();
  WallMarks marks(rings);
  for (std::uint32_t ring = 0; ring < rings.RingCount(); ++ring) {
    if (!IsCut(input, s, ring)) continue;
    const auto first = static_cast<std::uint32_t>(s.loops.points.size());
    for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      const Point at = PointAt(rings.points, k);
      s.loops.points.push_back({.at = at,
                                .root = placed.roots.empty() ? at : PointAt(placed.roots, k),
                                .normal_x = rings.normals[2 * k],
                                .normal_y = rings.normals[2 * k + 1]});
      marks.Set(k, s.loops.points.back());
    }
    const std::uint32_t outer = rings.outer_of[ring];
    s.loops.loops.push_back({.first = first,
                             .last = static_cast<std::uint32_t>(s.loops.points.size()),
                             .ring = ring,
                             .outer = outer == kNoRing ? ring : outer});
  }
}

// Cuts the loops at all sides of the window, moved by `steps`.
bool CutAtSides(const RingCutInput& input, int steps, RingCutScratch& s) {
  for (int axis = 0; axis < 2; ++axis) {
    const auto& ends = input.percolation.window.axes[static_cast<std::size_t>(axis)];
    if (!ends) continue;
    const double farthest = std::abs(ends->origin) + ends->length;
    const double step = kShiftSpacings * input.spacing +
                        kShiftBits * std::numeric_limits<double>::epsilon() * farthest;
    for (const bool is_lower : {true, false}) {
      double side = ends->origin + (is_lower ? 0 : ends->length);
      if (std::abs(side) < kAxisReach * input.spacing) side = 0;
      s.kept.Clear();
      if (!CutAtLine({.axis = axis,
                      .at = side + steps * step,
                      .keeps_above = is_lower,
                      .is_shared = input.is_shared},
                     s.loops, s.line, s.kept)) {
        return false;
      }
      std::swap(s.loops, s.kept);
    }
  }
  return true;
}

// Writes the new rings: the rings that are not cut, and the loops of each cut outer ring in its
// place.
class Assembly {
 public:
  Assembly(const RingCutInput& input, const Rings& from, const PlacedVertices& placed,
           RingCutScratch& s)
      : input_(input), from_(from), placed_(placed), s_(s), marks_(from), to_(s.rings) {
    to_.Clear();
    s_.roots.clear();
    s_.group.clear();
    s_.is_hole.clear();
    s_.continues.clear();
    s_.largest.assign(input.topology.components.size(), kNoRing);
  }

  // Returns false if a loop is too thin to have a direction.
  bool Run() {
    std::ranges::sort(s_.loops.loops, [](const Loops::Loop& a, const Loops::Loop& b) {
      return a.outer != b.outer ? a.outer < b.outer : a.first < b.first;
    });
    std::size_t loop = 0;
    for (std::uint32_t ring = 0; ring < from_.RingCount(); ++ring) {
      if (!IsCut(input_, s_, ring)) {
        AddRing(ring);
        continue;
      }
      while (loop < s_.loops.loops.size() && s_.loops.loops[loop].outer == ring) {
        if (!AddLoop(s_.loops.loops[loop++])) return false;
      }
    }
    NameLargest();
    AddParents();
    return true;
  }

 private:
  // The body of a ring, by its first component.
  std::uint32_t BodyOf(std::uint32_t ring) const {
    return input_.percolation.bodies[input_.topology.component_of_ring[s_.topology_ring[ring]]];
  }

  // Ends a new ring. `continues`: the ring whose parents it takes, or kNoRing.
  void EndRing(std::uint32_t outer, bool is_hole, std::uint32_t continues) {
    to_.offsets.push_back(static_cast<std::uint32_t>(to_.PointCount()));
    s_.group.push_back(s_.topology_ring[outer]);
    s_.is_hole.push_back(is_hole ? 1 : 0);
    s_.continues.push_back(continues);
  }

  void AddRing(std::uint32_t ring) {
    const auto append = [&](const auto& source, auto& target) {
      if (source.empty()) return;
      target.insert(target.end(), source.begin() + 2 * from_.offsets[ring],
                    source.begin() + 2 * from_.offsets[ring + 1]);
    };
    const auto first = static_cast<std::uint32_t>(to_.PointCount());
    for (std::uint32_t k = from_.offsets[ring]; k < from_.offsets[ring + 1]; ++k) {
      LoopPoint point;
      marks_.Set(k, point);
      AddMarks(first + k - from_.offsets[ring], point);
    }
    append(from_.points, to_.points);
    append(from_.normals, to_.normals);
    append(placed_.roots, s_.roots);
    to_.measures.push_back(from_.measures[ring]);
    const std::uint32_t outer = from_.outer_of[ring];
    EndRing(outer == kNoRing ? ring : outer, outer != kNoRing, ring);
  }

  void AddMarks(std::uint32_t index, const LoopPoint& point) {
    if (point.is_wet) to_.wetted.push_back(index);
    if (point.contact_angle == LoopPoint::kNoContact) return;
    to_.contacts.push_back(index);
    to_.contact_angles.push_back(point.contact_angle);
  }

  bool AddLoop(const Loops::Loop& loop) {
    const auto points = std::span(s_.loops.points).subspan(loop.first, loop.last - loop.first);
    double cut = 0;
    const auto first = static_cast<std::uint32_t>(to_.PointCount());
    for (std::size_t k = 0; k < points.size(); ++k) {
      const LoopPoint& point = points[k];
      to_.points.insert(to_.points.end(), {point.at.x, point.at.y});
      to_.normals.insert(to_.normals.end(), {point.normal_x, point.normal_y});
      if (!placed_.roots.empty()) {
        s_.roots.insert(s_.roots.end(), {point.root.x, point.root.y});
      }
      AddMarks(first + static_cast<std::uint32_t>(k), point);
      if (!point.is_cut) continue;
      to_.cuts.push_back(first + static_cast<std::uint32_t>(k));
      const Point& next = points[(k + 1) % points.size()].at;
      cut += std::abs(next.x - point.at.x) + std::abs(next.y - point.at.y);
    }
    const auto number = static_cast<std::uint32_t>(to_.measures.size());
    const bool is_hole = loop.ring != kNoSource && from_.outer_of[loop.ring] != kNoRing;
    EndRing(loop.outer, is_hole, is_hole ? loop.ring : kNoRing);
    RingMeasures& measures = to_.measures.emplace_back(MeasureRing(to_.RingPoints(number)));
    if ((measures.area > 0) == is_hole || measures.area == 0) return false;
    measures.perimeter = std::max(0.0, measures.perimeter - cut);
    if (is_hole) {
      measures.identity = from_.measures[loop.ring].identity;
      return true;
    }
    std::uint32_t& largest = s_.largest[BodyOf(loop.outer)];
    if (largest == kNoRing || measures.area > to_.measures[largest].area) largest = number;
    s_.continues[number] = loop.outer;
    return true;
  }

  // Gives the largest piece of each body its identity and number of particles. The other pieces
  // continue nothing.
  void NameLargest() {
    for (std::uint32_t ring = 0; ring < from_.RingCount(); ++ring) {
      if (from_.outer_of[ring] != kNoRing || !IsCut(input_, s_, ring)) continue;
      const std::uint32_t largest = s_.largest[BodyOf(ring)];
      if (largest == kNoRing) continue;
      to_.measures[largest].identity = from_.measures[ring].identity;
      to_.measures[largest].particle_count += from_.measures[ring].particle_count;
    }
    for (std::uint32_t number = 0; number < s_.continues.size(); ++number) {
      const std::uint32_t ring = s_.continues[number];
      if (ring == kNoRing || !IsCut(input_, s_, ring) || s_.is_hole[number]) continue;
      if (s_.largest[BodyOf(ring)] != number) s_.continues[number] = kNoRing;
    }
  }

  void AddParents() {
    if (from_.parent_offsets.size() < 2) return;
    for (const std::uint32_t ring : s_.continues) {
      if (ring != kNoRing) {
        const auto parents = from_.ParentsOf(ring);
        to_.parents.insert(to_.parents.end(), parents.begin(), parents.end());
      }
      to_.parent_offsets.push_back(static_cast<std::uint32_t>(to_.parents.size()));
    }
  }

  const RingCutInput& input_;
  const Rings& from_;
  const PlacedVertices& placed_;
  RingCutScratch& s_;
  WallMarks marks_;
  Rings& to_;
};

std::uint64_t CountCutBodies(const RingCutInput& input, const RingCutScratch& s,
                             std::vector<std::uint8_t>& seen) {
  seen.assign(input.topology.components.size(), 0);
  std::uint64_t count = 0;
  for (const Loops::Loop& loop : s.loops.loops) {
    if (loop.ring != kNoSource) continue;
    const std::uint32_t component = input.topology.component_of_ring[s.topology_ring[loop.outer]];
    std::uint8_t& is_seen = seen[input.percolation.bodies[component]];
    count += is_seen ? 0 : 1;
    is_seen = 1;
  }
  return count;
}

// Assigns holes to outer rings. Returns false if rings touch or are nested wrongly.
bool NestRings(RingCutScratch& s) {
  Rings& rings = s.rings;
  if (CountTouchingPairs(rings.points, rings.offsets, s.pairs) > 0) return false;
  s.depths.Find(rings.points, rings.offsets);
  const std::size_t count = rings.offsets.size() - 1;
  rings.outer_of.assign(count, kNoRing);
  for (std::size_t ring = 0; ring < count; ++ring) {
    const std::uint32_t around = s.depths.AroundOf(ring);
    const bool is_hole = s.is_hole[ring] != 0;
    if (is_hole) rings.outer_of[ring] = around;
    const bool is_in_hole = around != kNoRing && s.is_hole[around] != 0;
    if (is_hole ? around == kNoRing || is_in_hole : around != kNoRing && !is_in_hole) return false;
  }
  return true;
}

}  // namespace

void RemoveGoneRings(const Percolation& percolation, const RingTopology& topology,
                     PlacedVertices& placed, Rings& rings) {
  std::uint32_t kept = 0, end = 0;
  MovedMarks marks(rings);
  for (std::size_t ring = 0; ring < topology.RingCount(); ++ring) {
    const std::uint32_t old = placed.kept_as[ring];
    if (old == kNoRing) continue;
    if (percolation.IsGone(topology, ring)) {
      placed.kept_as[ring] = kNoRing;
      continue;
    }
    const std::uint32_t first = rings.offsets[old], last = rings.offsets[old + 1];
    const auto move = [&](auto& values) {
      if (values.empty()) return;
      std::copy(values.begin() + 2 * first, values.begin() + 2 * last, values.begin() + 2 * end);
    };
    move(rings.points);
    move(rings.normals);
    move(placed.roots);
    marks.Move(first, last, end);
    rings.measures[kept] = rings.measures[old];
    rings.outer_of[kept] = topology.outer_of[ring];  // Renumbered below.
    end += last - first;
    rings.offsets[kept] = end - (last - first);
    placed.kept_as[ring] = kept++;
  }
  marks.Finish();
  rings.offsets.resize(kept + 1);
  rings.offsets[kept] = end;
  rings.points.resize(2 * std::size_t{end});
  rings.normals.resize(2 * std::size_t{end});
  if (!placed.roots.empty()) placed.roots.resize(2 * std::size_t{end});
  rings.measures.resize(kept);
  rings.outer_of.resize(kept);
  for (std::uint32_t& outer : rings.outer_of) {
    if (outer != kNoRing) outer = placed.kept_as[outer];
  }
}

bool CanCutRings(const RingCutInput& input, int steps, RingCutScratch& s,
                 const PlacedVertices& placed, const Rings& rings) {
  ThrowIfCancelled();
  s.topology_ring.resize(rings.RingCount());
  for (std::uint32_t ring = 0; ring < placed.kept_as.size(); ++ring) {
    if (placed.kept_as[ring] != kNoRing) s.topology_ring[placed.kept_as[ring]] = ring;
  }
  CollectLoops(input, rings, placed, s);
  return CutAtSides(input, steps, s) && Assembly(input, rings, placed, s).Run() && NestRings(s);
}

bool CutRings(const RingCutInput& input, int steps, RingCutScratch& s, PlacedVertices& placed,
              Rings& rings, std::uint64_t& cut_bodies) {
  if (!CanCutRings(input, steps, s, placed, rings)) return false;
  std::swap(rings, s.rings);
  std::swap(placed.roots, s.roots);
  std::swap(placed.group_of_ring, s.group);
  cut_bodies = CountCutBodies(input, s, s.seen);
  return true;
}

void ClearOutside(const Percolation& percolation, const TileDirectory& directory,
                  const Components& components, double cell_size, Crossings& crossings) {
  // The cells along each axis that are strictly inside.
  std::array<std::int64_t, 2> first, last;
  for (std::size_t k = 0; k < 2; ++k) {
    constexpr std::int64_t kFar = std::int64_t{1} << 40;
    first[k] = -kFar;
    last[k] = kFar;
    if (!percolation.window.axes[k]) continue;
    const double lower = percolation.window.axes[k]->origin / cell_size;
    const double upper =
        (percolation.window.axes[k]->origin + percolation.window.axes[k]->length) / cell_size;
    // The sides may move a little, so a cell at a side does not count.
    first[k] = static_cast<std::int64_t>(std::floor(lower + .01)) + 1;
    last[k] = static_cast<std::int64_t>(std::ceil(upper - .01)) - 2;
  }
  for (std::uint32_t tile = 0; tile < directory.size(); ++tile) {
    const std::int64_t left = std::int64_t{directory[tile].x} << kTileShift;
    const std::int64_t bottom = std::int64_t{directory[tile].y} << kTileShift;
    for (int j = 0; j < kTileSize; ++j) {
      std::uint32_t& row = crossings.interior[tile][j];
      for (std::uint32_t bits = row; bits != 0; bits &= bits - 1) {
        const int i = std::countr_zero(bits);
        const Fate fate = percolation.fates[components.At(crossings, {tile, i, j})];
        const std::int64_t x = left + i, y = bottom + j;
        const bool is_inside = x >= first[0] && x <= last[0] && y >= first[1] && y <= last[1];
        if (fate == Fate::kGone || (fate == Fate::kCut && !is_inside)) {
          row &= ~(std::uint32_t{1} << i);
        }
      }
    }
  }
}

}  // namespace partiemc
