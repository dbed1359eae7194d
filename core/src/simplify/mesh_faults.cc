#include "simplify/mesh_faults.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "base/predicates_in_space.h"
#include "check/triangle_contact.h"
#include "check/triangle_grid.h"

namespace partiemc::simplify {
namespace {

// In units of WorkLimit. A contact costs more, because it also takes memory.
constexpr std::uint64_t kWorkOfPair = 32, kWorkOfExact = 1 << 10, kWorkOfContact = 1 << 16;

Triangle TriangleAt(std::span<const std::uint32_t> triangles, std::size_t triangle) {
  return {triangles[3 * triangle], triangles[3 * triangle + 1], triangles[3 * triangle + 2]};
}

Box Intersection(const Box& a, const Box& b) {
  return {Upper(a.low, b.low), Lower(a.high, b.high)};
}

/// A side of a triangle, and the triangle's third corner.
struct Side {
  std::uint32_t from, to, third;

  friend bool operator<(const Side& a, const Side& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  }
};

/// The sides of all triangles, sorted.
std::vector<Side> SidesOf(std::span<const std::uint32_t> triangles) {
  std::vector<Side> sides;
  sides.reserve(triangles.size());
  for (std::size_t t = 0; t < triangles.size() / 3; ++t) {
    const auto [a, b, c] = TriangleAt(triangles, t);
    sides.insert(sides.end(), {{a, b, c}, {b, c, a}, {c, a, b}});
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

}  // namespace

Box BoxOf(std::span<const double> points, std::span<const std::uint32_t> indices) {
  Box box{Vec3At(points, indices[0]), Vec3At(points, indices[0])};
  for (const std::uint32_t index : indices.subspan(1)) {
    const Vec3 at = Vec3At(points, index);
    box.low = Lower(box.low, at);
    box.high = Upper(box.high, at);
  }
  return box;
}

void FindManifoldFaults(std::span<const double> points, std::span<const std::uint32_t> triangles,
                        std::vector<Box>& faults) {
  faults.clear();
  const std::vector<Side> sides = SidesOf(triangles);
  const auto find = [&](std::uint32_t from, std::uint32_t to) {
    return std::lower_bound(sides.begin(), sides.end(), Side{from, to, 0});
  };
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const Side& side = sides[k];
    const bool is_double = k > 0 && !(sides[k - 1] < side);
    const auto opposite = find(side.to, side.from);
    const bool is_open =
        opposite == sides.end() || opposite->from != side.to || opposite->to != side.from;
    if (!is_double && !is_open && side.from != side.to) continue;
    faults.push_back(BoxOf(points, std::array{side.from, side.to}));
  }
  if (!faults.empty()) return;
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    const std::uint32_t point = sides[first].from;
    while (last < sides.size() && sides[last].from == point) ++last;
    // If S2 holds, turning about the point visits each of its triangles once.
    std::size_t visited = 0, side = first;
    do {
      side = find(point, sides[side].third) - sides.begin();
      ++visited;
    } while (side != first && visited <= last - first);
    if (visited != last - first) faults.push_back(BoxOf(points, std::array{point}));
  }
}

bool IsConnected(std::span<const std::uint32_t> triangles, std::size_t points) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  const auto [least, most] = std::minmax_element(triangles.begin(), triangles.end());
  const std::uint32_t first = *least;
  std::vector<std::uint32_t> parent(*most - first + 1, kUnused);
  std::size_t used = 0, joined = 0;
  const auto root_of = [&](std::uint32_t point) {
    std::uint32_t k = point - first;
    if (parent[k] == kUnused) {
      parent[k] = k;
      ++used;
    }
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  for (std::size_t t = 0; t < triangles.size() / 3; ++t) {
    for (int k = 1; k < 3; ++k) {
      const std::uint32_t a = root_of(triangles[3 * t]), b = root_of(triangles[3 * t + k]);
      joined += a != b ? 1 : 0;
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  return used == points && joined + 1 == used;
}

void FindContacts(std::span<const double> points, std::span<const std::uint32_t> triangles,
                  std::span<const std::uint8_t> kinds, TriangleGrid& grid,
                  std::vector<Contact>& contacts, WorkLimit* limit) {
  contacts.clear();
  std::vector<std::uint32_t> flat;  // Degenerate triangles that are not kNew; rare.
  for (std::uint32_t t = 0; t < triangles.size() / 3; ++t) {
    const Triangle corners = TriangleAt(triangles, t);
    if (!AreCollinear(Vec3At(points, corners[0]), Vec3At(points, corners[1]),
                      Vec3At(points, corners[2]))) {
      continue;
    }
    if (kinds[t] == kNew) {
      contacts.push_back({t, t, BoxOf(points, corners)});
    } else {
      flat.push_back(t);
    }
  }
  if (!contacts.empty()) return;
  const auto is_flat = [&](std::uint32_t t) {
    return !flat.empty() && std::binary_search(flat.begin(), flat.end(), t);
  };
  grid.Build(points, triangles);
  if (limit != nullptr) limit->Take(grid.PairsOfCells());
  WorkCounter work(limit);
  grid.ForEachPair([&](std::uint32_t a, std::uint32_t b) {
    const int kind = kinds[a] | kinds[b];
    if ((kind & kNew) == 0 && kind != (kKept | kChanged)) return true;
    if (is_flat(a) || is_flat(b)) return true;
    work.Add(kWorkOfPair);
    const Triangle first = TriangleAt(triangles, a), second = TriangleAt(triangles, b);
    const std::uint64_t exact = ExactPredicates();
    const bool collide = TrianglesCollide(points, first, second);
    work.Add(kWorkOfExact * (ExactPredicates() - exact));
    if (collide) {
      work.Add(kWorkOfContact);
      contacts.push_back({a, b, Intersection(BoxOf(points, first), BoxOf(points, second))});
    }
    return true;
  });
  work.Finish();
}

}  // namespace partiemc::simplify
