#include "space_vertices/drops.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <utility>

#include "base/bits.h"
#include "base/cancellation.h"
#include "space/surface_bytes.h"

namespace partiemc::space {
namespace {

// A drop that reaches more bricks along an axis keeps its surface.
constexpr double kMostBricksAlong = 4;
// Radius in spacings. Smaller drops become icosahedra, whose edges are about as long as a cell of
// the default size.
constexpr double kSmallRadius = .75;
constexpr std::uint32_t kTrianglesPerCheck = 1 << 12;

// Drops that are bent, hollow or in pieces fill less of the ellipsoid with their moments.
constexpr double kLeastFilling = .5;
// Least half axis of an ellipsoid, in cells: kLeastAxis, plus kLeastAxisByDistance times the
// distance from the origin of the world.
constexpr double kLeastAxis = 1e-3, kLeastAxisByDistance = 1e-9;

/// The radius of a ball with a volume.
double RadiusOf(double volume) { return CubeRoot(3 / (4 * std::numbers::pi) * volume); }

/// A polyhedron with its corners on the unit sphere.
struct Polyhedron {
  std::vector<Vec3> corners;
  std::vector<VertexTriangle> triangles;
  double volume = 0;

  void Measure() {
    volume = 0;
    for (const auto& [a, b, c] : triangles) {
      volume += Dot(corners[a], Cross(corners[b], corners[c])) / 6;
    }
  }
};

Polyhedron Icosahedron() {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  Polyhedron all;
  for (int axis = 0; axis < 3; ++axis) {
    for (int signs = 0; signs < 4; ++signs) {
      const double u = (signs & 1) != 0 ? -1 : 1, v = (signs & 2) != 0 ? -golden : golden;
      const Vec3 corner = axis == 0 ? Vec3{0, u, v} : axis == 1 ? Vec3{v, 0, u} : Vec3{u, v, 0};
      all.corners.push_back(Normalised(corner));
    }
  }
  // Each three corners that are near each other form a triangle.
  const auto are_near = [&](std::uint32_t a, std::uint32_t b) {
    return Dot(all.corners[a], all.corners[b]) > .4;
  };
  for (std::uint32_t a = 0; a < 12; ++a) {
    for (std::uint32_t b = a + 1; b < 12; ++b) {
      for (std::uint32_t c = b + 1; c < 12; ++c) {
        if (!are_near(a, b) || !are_near(b, c) || !are_near(a, c)) continue;
        const bool is_outward = Dot(all.corners[a], Cross(all.corners[b], all.corners[c])) > 0;
        all.triangles.push_back(is_outward ? VertexTriangle{a, b, c} : VertexTriangle{a, c, b});
      }
    }
  }
  all.Measure();
  return all;
}

/// Cuts each triangle into four, with the new corners on the sphere.
Polyhedron Divided(const Polyhedron& from) {
  Polyhedron all{from.corners, {}, 0};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, is_new] =
        middles.try_emplace({std::min(a, b), std::max(a, b)}, all.corners.size());
    if (is_new) all.corners.push_back(Normalised(from.corners[a] + from.corners[b]));
    return at->second;
  };
  for (const auto& [a, b, c] : from.triangles) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    all.triangles.insert(all.triangles.end(),
                         {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  all.Measure();
  return all;
}

const Polyhedron& PolyhedronFor(double radius) {
  static const Polyhedron small = Icosahedron(), large = Divided(small);
  return radius < kSmallRadius ? small : large;
}

void Include(const Vec3& point, Drops::Box& box) {
  box.low = Lower(box.low, point);
  box.high = Upper(box.high, point);
}

bool Touch(const Drops::Box& a, const Drops::Box& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

/// Adds a particle to the moments. `at` and `volume` are in cells.
void AddParticle(const Vec3& at, double volume, Drops::Drop& drop) {
  if (!(drop.volume > 0)) drop.origin = at;
  const Vec3 from = at - drop.origin;
  drop.volume += volume;
  drop.first = drop.first + volume * from;
  const double radius = RadiusOf(volume), own = radius * radius / 5;
  const std::array<double, 6> products = {from.x * from.x + own, from.x * from.y,
                                          from.x * from.z,       from.y * from.y + own,
                                          from.y * from.z,       from.z * from.z + own};
  for (int k = 0; k < 6; ++k) drop.second[k] += volume * products[k];
}

/// Computes the points and normals of an ellipsoid with the volume and the moments of the drop.
/// Returns false if there is no such ellipsoid, or it is too thin, or the drop fills too little of
/// it.
bool MakeEllipsoid(const Scale& scale, const Drops::Drop& drop, Drops& drops) {
  if (!(drop.volume > 0)) return false;
  const double inverse = 1 / drop.volume;
  const Vec3 centre = inverse * drop.first;
  const auto moment = [&](int k, double a, double b) {
    return 5 * (inverse * drop.second[k] - a * b);
  };
  const double xx = moment(0, centre.x, centre.x), xy = moment(1, centre.x, centre.y),
               xz = moment(2, centre.x, centre.z), yy = moment(3, centre.y, centre.y),
               yz = moment(4, centre.y, centre.z), zz = moment(5, centre.z, centre.z);
  // The lower triangular root L of the matrix: L times the unit sphere is the ellipsoid.
  const double a = std::sqrt(xx), b = xy / a, c = xz / a;
  const double d = std::sqrt(yy - b * b), e = (yz - b * c) / d;
  const double f = std::sqrt(zz - c * c - e * e);
  const double determinant = a * d * f;
  if (!(determinant > 0) || !std::isfinite(determinant)) return false;
  const Polyhedron& of = PolyhedronFor(RadiusOf(drop.volume) / scale.spacing);
  const double factor = CubeRoot(drop.volume / (determinant * of.volume));
  if (!(drop.volume > kLeastFilling * (4 * std::numbers::pi / 3) * determinant)) return false;
  // A lower bound of its shortest half axis, in cells. Rounding must not fold the triangles.
  const double shortest = factor * determinant / (xx + yy + zz);
  const double farthest =
      std::max({std::abs(drop.origin.x), std::abs(drop.origin.y), std::abs(drop.origin.z)});
  if (!(shortest > kLeastAxis + kLeastAxisByDistance * farthest)) return false;
  drops.points.clear();
  drops.normals.clear();
  for (const Vec3& u : of.corners) {
    const Vec3 from = factor * Vec3{a * u.x, b * u.x + d * u.y, c * u.x + e * u.y + f * u.z};
    drops.points.push_back(scale.cell_size * (drop.origin + centre + from));
    // The transposed inverse of L.
    const double z = u.z / f, y = (u.y - e * z) / d;
    drops.normals.push_back(Normalised({(u.x - b * y - c * z) / a, y, z}));
  }
  return true;
}

/// Sets the node and the box of a drop. Returns false if there is no ellipsoid.
bool SetBox(const Scale& scale, const Vec3& node, Drops::Drop& drop, Drops& drops) {
  if (!MakeEllipsoid(scale, drop, drops)) return false;
  drop.node = node;
  drop.ellipsoid = Drops::Box::Empty();
  for (const Vec3& point : drops.points) Include(point, drop.ellipsoid);
  return true;
}

/// The box around the ellipsoid and the node of a drop, which no other surface may touch.
Drops::Box BoxOf(const Drops::Drop& drop) {
  Drops::Box box = drop.ellipsoid;
  Include(drop.node, box);
  return box;
}

/// Calls visit(coordinate) for the bricks that a box reaches. Visits none and returns false if they
/// are more than kMostBricksAlong along an axis.
template <typename Visit>
bool ForEachBrickOf(const Drops::Box& box, double cell_size, const Visit& visit) {
  const double unit = 1 / (kBrickSize * cell_size);
  const auto floor = [unit](const Vec3& at) {
    return Vec3{std::floor(unit * at.x), std::floor(unit * at.y), std::floor(unit * at.z)};
  };
  const Vec3 low = floor(box.low), high = floor(box.high);
  const Vec3 along = high - low;
  if (!(std::max({along.x, along.y, along.z}) < kMostBricksAlong)) return false;
  const auto at = [](double value) { return static_cast<std::int32_t>(value); };
  for (std::int32_t z = at(low.z); z <= at(high.z); ++z) {
    for (std::int32_t y = at(low.y); y <= at(high.y); ++y) {
      for (std::int32_t x = at(low.x); x <= at(high.x); ++x) visit(BrickCoordinate{z, y, x});
    }
  }
  return true;
}

/// Whether nodes have moved from their places in the lattice.
enum class NodesAre { kAtRest, kMoved };

/// Finds the drops, their moments and their boxes. Takes all that have an ellipsoid. Leaves out
/// lone particles that cannot become ellipsoids, unless they matter for other drops.
void FindDrops(const DropsInput& input, const DropLimits& limits, NodesAre nodes_are,
               Drops& drops) {
  const Bodies& bodies = input.bodies;
  const double cell = input.scale.cell_size;
  const double unit = 1 / (cell * cell * cell);
  drops.drops.clear();
  drops.drop_of.assign(bodies.bodies.size(), kNoIndex);
  for (std::uint32_t body = 0; body < bodies.bodies.size(); ++body) {
    const std::uint64_t particles = bodies.bodies[body].particles;
    // A body that is cut is longer than the box, or the box wraps.
    const bool is_whole = !bodies.IsCut(body) || bodies.bodies[body].is_complete;
    if (particles == 0 || particles > limits.most_particles || !is_whole) continue;
    drops.drop_of[body] = static_cast<std::uint32_t>(drops.drops.size());
    Drops::Drop& drop = drops.drops.emplace_back();
    drop.body = body;
    drop.particles = particles;
  }
  const double h = input.scale.spacing, usual = h * h * h;
  const bool takes_lone = limits.least_particles <= 1;
  for (std::uint32_t brick = 0; brick < input.bins.bricks.size(); ++brick) {
    const Vec3 origin = OriginOf(input.bins.bricks[brick]);
    const SpaceBins& bins = input.bins;
    std::uint32_t at_home = 0;  // Listed lone particles of this brick that reach it.
    for (std::uint32_t p = bins.FirstOf(brick); p < bins.EndOf(brick); ++p) {
      if (p % kItemsPerCheck == 0) ThrowIfCancelled();
      const std::uint32_t body = bodies.body_of_particle[p];
      if (body == kDroppedBody || (body != kNoIndex && drops.drop_of[body] == kNoIndex)) continue;
      const bool is_alone = !bins.IsImage(p) || (input.takes_copies && !bins.IsMirror(p));
      if (body == kNoIndex && !is_alone) continue;
      const Vec3 within{input.bins.x[p], input.bins.y[p], input.bins.z[p]};
      const Vec3 at = origin + within;
      const double volume =
          input.frame.volumes.empty() ? usual : unit * input.frame.volumes[input.bins.source[p]];
      if (body != kNoIndex) {
        Drops::Drop& drop = drops.drops[drops.drop_of[body]];
        AddParticle(at, volume, drop);
        continue;
      }
      const std::array<int, 3> node{static_cast<int>(within.x), static_cast<int>(within.y),
                                    static_cast<int>(within.z)};
      const bool is_free = nodes_are == NodesAre::kAtRest ||
                           input.nodes.IndexOf({brick, node[0], node[1], node[2]}) == kNoIndex;
      if (!takes_lone || volume < unit * limits.least_volume || !is_free) continue;
      Drops::Drop drop;
      drop.particle = p;
      AddParticle(at, volume, drop);
      drop.particles = 1;
      // This node is outside and has not moved, so it is still outside of all bodies.
      const Vec3 corner = cell * (origin + Vec3{1.0 * node[0], 1.0 * node[1], 1.0 * node[2]});
      drop.is_taken = SetBox(input.scale, corner, drop, drops);
      if (!drop.is_taken) continue;
      std::uint32_t reached = 0, is_at_home = 0;
      ForEachBrickOf(BoxOf(drop), cell, [&](const BrickCoordinate& place) {
        ++reached;
        if (place == input.bins.bricks[brick]) is_at_home = 1;
      });
      // A brick with too many drops needs no more that reach no other brick.
      const bool is_needless = is_at_home == reached && at_home > kMostDropsOfBrick;
      if (reached == 0 || is_needless) continue;
      at_home += is_at_home;
      drops.drops.push_back(drop);
    }
  }
  for (Drops::Drop& drop : drops.drops) {
    if (drop.body == kNoIndex) continue;
    const BrickPlace& lowest = bodies.bodies[drop.body].lowest;
    const std::array<int, 3> node{lowest.i, lowest.j, lowest.k};
    const Vec3 at = nodes_are == NodesAre::kAtRest
                        ? cell * (OriginOf(input.bins.bricks[lowest.brick]) +
                                  Vec3{1.0 * node[0], 1.0 * node[1], 1.0 * node[2]})
                        : NodeAt(input.bins.bricks, input.nodes, cell, lowest.brick, node);
    drop.is_taken = SetBox(input.scale, at, drop, drops);
  }
}

/// Lists the taken drops by brick. Drops that reach too many bricks keep their surfaces.
void ListDrops(double cell_size, Drops& drops) {
  drops.bricks.Clear();
  drops.reaches.clear();
  for (std::uint32_t index = 0; index < drops.drops.size(); ++index) {
    if (index % kItemsPerCheck == 0) ThrowIfCancelled();
    Drops::Drop& drop = drops.drops[index];
    if (!drop.is_taken) continue;
    drop.is_taken = ForEachBrickOf(BoxOf(drop), cell_size, [&](const BrickCoordinate& at) {
      drops.reaches.push_back({drops.bricks.Insert(at), index});
    });
  }
  std::sort(drops.reaches.begin(), drops.reaches.end());
  drops.first.assign(drops.bricks.size() + 1, 0);
  for (const Drops::Reach& reach : drops.reaches) ++drops.first[reach.brick + 1];
  for (std::size_t k = 1; k < drops.first.size(); ++k) drops.first[k] += drops.first[k - 1];
}

/// Drops whose ellipsoids have boxes that touch each other keep their surfaces, as do all drops
/// that reach a brick with more than kMostDropsOfBrick of them.
void CompareDrops(Drops& drops) {
  for (std::size_t brick = 0; brick + 1 < drops.first.size(); ++brick) {
    ThrowIfCancelled();
    const std::uint32_t first = drops.first[brick], last = drops.first[brick + 1];
    for (std::uint32_t k = first; k < last; ++k) {
      Drops::Drop& drop = drops.drops[drops.reaches[k].drop];
      if (last - first > kMostDropsOfBrick) {
        drop.is_taken = false;
        continue;
      }
      for (std::uint32_t m = first; m < k; ++m) {
        Drops::Drop& other = drops.drops[drops.reaches[m].drop];
        if (Touch(drop.ellipsoid, other.ellipsoid)) drop.is_taken = other.is_taken = false;
      }
    }
  }
}

/// Drops whose boxes touch `box`, which has a part of the surface of `body`, keep their surfaces,
/// unless they are drops of this body. Lists drops of bodies in `refused`.
void CompareBox(const Drops::Box& box, std::uint32_t body, double cell_size, Drops& drops) {
  const auto compare = [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t k = first; k < last; ++k) {
      const std::uint32_t index = drops.reaches[k].drop;
      Drops::Drop& drop = drops.drops[index];
      if (drop.body == body || !drop.is_taken || !Touch(BoxOf(drop), box)) continue;
      drop.is_taken = false;
      if (drop.body != kNoIndex) drops.refused.push_back(index);
    }
  };
  const bool is_small = ForEachBrickOf(box, cell_size, [&](const BrickCoordinate& at) {
    const std::uint32_t brick = drops.bricks.Find(at);
    if (brick == kNoIndex) return;
    const std::uint32_t first = drops.first[brick], last = drops.first[brick + 1];
    if (last - first <= kMostDropsOfBrick) compare(first, last);  // Else none is taken.
  });
  if (!is_small) compare(0, static_cast<std::uint32_t>(drops.reaches.size()));
}

/// Decides which drops are taken: the ellipsoid of each is apart from the others, and its box
/// touches no surface of a body that remains. `for_each_part` calls its argument with (body, box)
/// for boxes that hold all surfaces.
template <typename ForEachPart>
void ChooseDrops(double cell_size, const ForEachPart& for_each_part, Drops& drops) {
  ListDrops(cell_size, drops);
  CompareDrops(drops);
  const auto of_bodies = static_cast<std::uint32_t>(
      std::ranges::count_if(drops.drop_of, [](std::uint32_t drop) { return drop != kNoIndex; }));
  drops.surfaces.assign(of_bodies, Drops::Box::Empty());
  for_each_part([&](std::uint32_t body, const Drops::Box& box) {
    const std::uint32_t index = drops.drop_of[body];
    if (index == kNoIndex) {
      CompareBox(box, body, cell_size, drops);
    } else {
      Include(box.low, drops.surfaces[index]);
      Include(box.high, drops.surfaces[index]);
    }
  });
  // A refused drop keeps its surface, so that further drops are refused.
  drops.refused.clear();
  for (std::uint32_t index = 0; index < of_bodies; ++index) {
    if (!drops.drops[index].is_taken) drops.refused.push_back(index);
  }
  for (std::size_t n = 0; n < drops.refused.size(); ++n) {
    if (n % kTrianglesPerCheck == 0) ThrowIfCancelled();
    const Drops::Drop& drop = drops.drops[drops.refused[n]];
    const Drops::Box surface = drops.surfaces[drops.refused[n]];
    if (surface.low.x <= surface.high.x) CompareBox(surface, drop.body, cell_size, drops);
  }
}

/// Calls visit(body, box) for the active cells of each body.
template <typename Visit>
void ForEachCellOf(const DropsInput& input, const Visit& visit) {
  const double cell_size = input.scale.cell_size;
  std::uint32_t until_check = 0;
  for (const ActiveCell& cell : input.crossings.cells) {
    if (until_check-- == 0) {
      ThrowIfCancelled();
      until_check = kTrianglesPerCheck;
    }
    const Vec3 low =
        OriginOf(input.bins.bricks[cell.brick]) + Vec3{1.0 * cell.i, 1.0 * cell.j, 1.0 * cell.k};
    const Drops::Box box{cell_size * low, cell_size * (low + Vec3{1, 1, 1})};
    for (int loop = 0; loop < LoopsOf(cell.corners).loops; ++loop) {
      visit(input.body_of[cell.first_loop + loop], box);
    }
  }
}

/// Calls visit(body, box) for each triangle.
template <typename Visit>
void ForEachTriangleOf(const DropsInput& input, std::span<const Vec3> positions,
                       std::span<const VertexTriangle> triangles, const Visit& visit) {
  std::uint32_t until_check = 0;
  for (const VertexTriangle& triangle : triangles) {
    if (until_check-- == 0) {
      ThrowIfCancelled();
      until_check = kTrianglesPerCheck;
    }
    Drops::Box box{positions[triangle[0]], positions[triangle[0]]};
    Include(positions[triangle[1]], box);
    Include(positions[triangle[2]], box);
    visit(input.body_of[triangle[0]], box);
  }
}

/// Replaces the surfaces of the drops that are taken. Those of gone images get no ellipsoids.
void TakeDrops(const DropsInput& input, Drops& drops, std::vector<Vec3>& positions,
               std::vector<Vec3>& normals, std::vector<VertexTriangle>& triangles) {
  std::erase_if(triangles, [&](const VertexTriangle& triangle) {
    const std::uint32_t drop = drops.drop_of[input.body_of[triangle[0]]];
    return drop != kNoIndex && drops.drops[drop].is_taken;
  });
  std::uint32_t until_check = 0;
  for (Drops::Drop& drop : drops.drops) {
    if (until_check-- == 0) {
      ThrowIfCancelled();
      until_check = kItemsPerCheck;
    }
    if (drop.body != kNoIndex && input.bodies.IsGone(drop.body)) drop.is_taken = false;
    if (!drop.is_taken) continue;
    const Polyhedron& of = PolyhedronFor(RadiusOf(drop.volume) / input.scale.spacing);
    drop.first_vertex = static_cast<std::uint32_t>(positions.size());
    MakeEllipsoid(input.scale, drop, drops);  // Again: to store all points would take much memory.
    positions.insert(positions.end(), drops.points.begin(), drops.points.end());
    normals.insert(normals.end(), drops.normals.begin(), drops.normals.end());
    for (const auto& [a, b, c] : of.triangles) {
      triangles.push_back({drop.first_vertex + a, drop.first_vertex + b, drop.first_vertex + c});
    }
  }
}

}  // namespace

void SettleDrops(const DropsInput& input, const DropLimits& limits, Drops& drops) {
  drops.is_settled.clear();
  if (limits.most_particles == 0) return;
  FindDrops(input, limits, NodesAre::kAtRest, drops);
  if (drops.drops.empty()) return;
  ChooseDrops(
      input.scale.cell_size, [&](const auto& visit) { ForEachCellOf(input, visit); }, drops);
  drops.is_settled.assign(input.bodies.bodies.size(), 0);
  for (const Drops::Drop& drop : drops.drops) {
    // The images of a body that is cut move alike, and not all of them may be drops.
    if (drop.body == kNoIndex || input.bodies.IsCut(drop.body)) continue;
    drops.is_settled[drop.body] = drop.is_taken;
  }
}

bool ReplaceDrops(const DropsInput& input, const DropLimits& limits, Drops& drops,
                  std::vector<Vec3>& positions, std::vector<Vec3>& normals,
                  std::vector<VertexTriangle>& triangles) {
  drops.drops.clear();
  if (limits.most_particles == 0) return true;
  FindDrops(input, limits, NodesAre::kMoved, drops);
  if (drops.drops.empty()) return true;
  ThrowIfCancelled();
  const auto for_each_triangle = [&](const auto& visit) {
    ForEachTriangleOf(input, positions, triangles, visit);
  };
  ChooseDrops(input.scale.cell_size, for_each_triangle, drops);
  const bool is_refused = std::ranges::any_of(drops.drops, [&](const Drops::Drop& drop) {
    return !drop.is_taken && drop.body != kNoIndex && drops.IsSettled(drop.body);
  });
  if (is_refused) return false;
  TakeDrops(input, drops, positions, normals, triangles);
  return true;
}

}  // namespace partiemc::space
