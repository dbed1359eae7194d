#include "space_cut/plane_cut.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "base/bits.h"
#include "base/predicates_in_space.h"

namespace partiemc::space {
namespace {

using Edge = PlaneCutScratch::Edge;
using CapEdge = CutMesh::CapEdge;

double Coordinate(const CutMesh& mesh, std::uint32_t point, int axis) {
  return mesh.points[3 * std::size_t{point} + static_cast<std::size_t>(axis)];
}

Edge EdgeOf(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

/// Finds the side of each point. Returns false if a used point is too close to the plane.
bool FindSides(const AxisPlane& plane, double clearance, const CutMesh& mesh, PlaneCutScratch& s) {
  const std::size_t count = mesh.points.size() / 3;
  s.side.resize(count);
  for (std::uint32_t point = 0; point < count; ++point) {
    const double above = Coordinate(mesh, point, plane.axis) - plane.at;
    s.side[point] = std::abs(above) < clearance || above == 0 ? std::int8_t{0}
                    : (above > 0) == plane.keeps_above        ? std::int8_t{1}
                                                              : std::int8_t{-1};
  }
  for (const std::uint32_t point : mesh.triangles) {
    if (s.side[point] == 0) return false;
  }
  for (const CutMesh::Cap& cap : mesh.caps) {
    for (const CapEdge& edge : cap.edges) {
      if (s.side[edge.from] == 0) return false;
    }
  }
  return true;
}

void ListCrossedEdges(const CutMesh& mesh, PlaneCutScratch& s) {
  s.edges.clear();
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (s.side[a] != s.side[b]) s.edges.push_back(EdgeOf(a, b));
  };
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    const std::uint32_t* const corners = &mesh.triangles[k];
    for (int c = 0; c < 3; ++c) add(corners[c], corners[(c + 1) % 3]);
  }
  for (const CutMesh::Cap& cap : mesh.caps) {
    for (const CapEdge& edge : cap.edges) add(edge.from, edge.to);
  }
  std::sort(s.edges.begin(), s.edges.end());
  s.edges.erase(std::unique(s.edges.begin(), s.edges.end()), s.edges.end());
}

/// Whether a point lies on the plane of an earlier cap although an end of its edge does not.
bool LiesOnOtherPlane(const CutMesh& mesh, const Edge& edge, std::uint32_t point) {
  return std::any_of(mesh.caps.begin(), mesh.caps.end(), [&](const CutMesh::Cap& cap) {
    const auto is_on = [&](std::uint32_t p) {
      return Coordinate(mesh, p, cap.plane.axis) == cap.plane.at;
    };
    return is_on(point) && !(is_on(edge.low) && is_on(edge.high));
  });
}

/// Appends the normal at the part t of an edge, counted from edge.low. Where normals cancel, it is
/// the normal of edge.low.
void AddNormal(const Edge& edge, double t, CutMesh& mesh) {
  const auto normal_of = [&](std::uint32_t point) {
    const float* const normal = &mesh.normals[3 * std::size_t{point}];
    return Vec3{normal[0], normal[1], normal[2]};
  };
  const Vec3 from = normal_of(edge.low);
  const Vec3 mean = from + t * (normal_of(edge.high) - from);
  const Vec3 normal = Length(mean) > 1e-3 ? Normalised(mean) : from;
  for (const double along : {normal.x, normal.y, normal.z}) {
    mesh.normals.push_back(static_cast<float>(along));
  }
}

/// Appends a point for each crossed edge. Returns false if rounding moves one onto another plane.
bool AddCrossings(const AxisPlane& plane, const PlaneCutScratch& s, CutMesh& mesh) {
  for (const Edge& edge : s.edges) {
    const double low = Coordinate(mesh, edge.low, plane.axis);
    const double high = Coordinate(mesh, edge.high, plane.axis);
    const double t = (plane.at - low) / (high - low);
    const auto point = static_cast<std::uint32_t>(mesh.points.size() / 3);
    for (int axis = 0; axis < 3; ++axis) {
      const double from = Coordinate(mesh, edge.low, axis), to = Coordinate(mesh, edge.high, axis);
      const double between =
          std::clamp(from + t * (to - from), std::min(from, to), std::max(from, to));
      // Coordinates too small for the predicates become 0.
      mesh.points.push_back(axis == plane.axis ? plane.at : InSpaceDomain(between) ? between : 0.0);
    }
    AddNormal(edge, t, mesh);
    if (LiesOnOtherPlane(mesh, edge, point)) return false;
  }
  return true;
}

class CrossingPoints {
 public:
  CrossingPoints(const PlaneCutScratch& scratch, std::uint32_t first)
      : edges_(scratch.edges), first_(first) {}
  std::uint32_t On(std::uint32_t a, std::uint32_t b) const {
    const auto found = std::lower_bound(edges_.begin(), edges_.end(), EdgeOf(a, b));
    return first_ + static_cast<std::uint32_t>(found - edges_.begin());
  }

 private:
  std::span<const Edge> edges_;
  std::uint32_t first_;
};

double SquaredDistance(const CutMesh& mesh, std::uint32_t a, std::uint32_t b) {
  const Vec3 apart = Vec3At(mesh.points, a) - Vec3At(mesh.points, b);
  return Dot(apart, apart);
}

void ClipTriangles(const CrossingPoints& crossings, CutMesh& mesh, PlaneCutScratch& s) {
  s.triangles.clear();
  s.shell_of.clear();
  s.is_clipped.clear();
  s.cap_edges.clear();
  for (std::size_t t = 0; t < mesh.triangles.size() / 3; ++t) {
    const std::uint32_t* const corners = &mesh.triangles[3 * t];
    const std::uint32_t shell = mesh.shell_of[t];
    const auto emit = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, bool is_clipped) {
      s.triangles.insert(s.triangles.end(), {a, b, c});
      s.shell_of.push_back(shell);
      s.is_clipped.push_back(is_clipped || mesh.is_clipped[t] != 0 ? 1 : 0);
    };
    int kept = 0;
    for (int c = 0; c < 3; ++c) kept += s.side[corners[c]] > 0 ? 1 : 0;
    if (kept == 0) continue;
    if (kept == 3) {
      emit(corners[0], corners[1], corners[2], false);
      continue;
    }
    // Turns the triangle so that its first corner is alone on its side.
    const std::int8_t lonely = kept == 1 ? 1 : -1;
    int first = 0;
    while (s.side[corners[first]] != lonely) ++first;
    const std::uint32_t a = corners[first], b = corners[(first + 1) % 3],
                        c = corners[(first + 2) % 3];
    const std::uint32_t p = crossings.On(a, b), q = crossings.On(a, c);
    if (kept == 1) {
      emit(a, p, q, true);
      s.cap_edges.push_back({q, p, shell});
      continue;
    }
    // The quad p, b, c, q is cut along its shorter diagonal.
    if (SquaredDistance(mesh, p, c) < SquaredDistance(mesh, b, q)) {
      emit(p, b, c, true);
      emit(p, c, q, true);
    } else {
      emit(p, b, q, true);
      emit(b, c, q, true);
    }
    s.cap_edges.push_back({p, q, shell});
  }
  mesh.triangles.swap(s.triangles);
  mesh.shell_of.swap(s.shell_of);
  mesh.is_clipped.swap(s.is_clipped);
}

/// Clips the edges of an earlier cap, and closes the cap along the common line of both planes.
/// Returns false if inside and outside do not alternate on the line.
bool ClipCap(const AxisPlane& plane, const CrossingPoints& points, CutMesh& mesh, CutMesh::Cap& cap,
             PlaneCutScratch& s) {
  s.crossings.clear();
  s.line_edges.clear();
  const int third = 3 - plane.axis - cap.plane.axis;  // Parallel planes have no crossings.
  for (const CapEdge& edge : cap.edges) {
    const bool begins = s.side[edge.from] > 0, ends = s.side[edge.to] > 0;
    if (begins && ends) s.line_edges.push_back(edge);
    if (begins == ends) continue;
    const std::uint32_t point = points.On(edge.from, edge.to);
    s.crossings.push_back({Coordinate(mesh, point, third), point, edge.shell, ends});
    s.line_edges.push_back(ends ? CapEdge{point, edge.to, edge.shell}
                                : CapEdge{edge.from, point, edge.shell});
  }
  std::sort(s.crossings.begin(), s.crossings.end(),
            [](const auto& a, const auto& b) { return a.along < b.along; });
  for (std::size_t k = 0; k + 1 < s.crossings.size(); ++k) {
    if (s.crossings[k].along == s.crossings[k + 1].along) return false;
  }
  if (s.crossings.size() % 2 != 0) return false;
  // As in line_cut.cc, in the frame of the cap.
  const bool begins_with_entry = (PlaneFrame(cap.plane)[0] == plane.axis) == plane.keeps_above;
  for (std::size_t k = 0; k < s.crossings.size(); k += 2) {
    const auto &low = s.crossings[k], &high = s.crossings[k + 1];
    if (low.is_entry != begins_with_entry || high.is_entry == begins_with_entry) return false;
    const auto& entry = low.is_entry ? low : high;
    const auto& exit = low.is_entry ? high : low;
    s.line_edges.push_back({exit.point, entry.point, exit.shell});
    s.cap_edges.push_back({entry.point, exit.point, exit.shell});
  }
  cap.edges.swap(s.line_edges);
  return true;
}

/// Joins edges on a plane to closed loops of its points. Returns false if that is impossible, or
/// if two points have the same position.
bool FindLoops(const CutMesh& mesh, const AxisPlane& plane, std::span<const CapEdge> edges,
               PlaneCutScratch& s) {
  const std::array<int, 2> frame = PlaneFrame(plane);
  s.point_of.clear();
  for (const CapEdge& edge : edges) s.point_of.push_back(edge.from);
  std::sort(s.point_of.begin(), s.point_of.end());
  if (std::adjacent_find(s.point_of.begin(), s.point_of.end()) != s.point_of.end()) return false;
  s.flat_points.clear();
  s.places.clear();
  for (const std::uint32_t point : s.point_of) {
    const double x = Coordinate(mesh, point, frame[0]), y = Coordinate(mesh, point, frame[1]);
    s.flat_points.insert(s.flat_points.end(), {x, y});
    s.places.push_back({x, y});
  }
  std::sort(s.places.begin(), s.places.end());
  if (std::adjacent_find(s.places.begin(), s.places.end()) != s.places.end()) return false;
  const auto index_of = [&](std::uint32_t point) {
    const auto found = std::lower_bound(s.point_of.begin(), s.point_of.end(), point);
    return found != s.point_of.end() && *found == point
               ? static_cast<std::uint32_t>(found - s.point_of.begin())
               : kNoIndex;
  };
  s.next.assign(s.point_of.size(), kNoIndex);
  s.shell_of.resize(s.point_of.size());
  for (const CapEdge& edge : edges) {
    const std::uint32_t to = index_of(edge.to);
    if (to == kNoIndex) return false;
    const std::uint32_t from = index_of(edge.from);
    s.next[from] = to;
    s.shell_of[from] = edge.shell;
  }
  s.loop_points.clear();
  s.loop_offsets.assign(1, 0);
  for (std::uint32_t start = 0; start < s.next.size(); ++start) {
    if (s.next[start] == kNoIndex) continue;
    std::uint32_t point = start;
    while (s.next[point] != kNoIndex) {
      s.loop_points.push_back(point);
      const std::uint32_t next = s.next[point];
      s.next[point] = kNoIndex;
      point = next;
    }
    if (point != start) return false;
    s.loop_offsets.push_back(static_cast<std::uint32_t>(s.loop_points.size()));
  }
  return true;
}

/// Triangulates the region to the left of edges on a plane. Returns false, with the mesh unchanged,
/// if they do not form simple loops.
bool TriangulateCap(const AxisPlane& plane, std::span<const CapEdge> edges, CutMesh& mesh,
                    PlaneCutScratch& s) {
  if (!FindLoops(mesh, plane, edges, s)) return false;
  s.flat_triangles.clear();
  if (!s.triangulator.Triangulate(s.flat_points, s.loop_points, s.loop_offsets, s.flat_triangles)) {
    return false;
  }
  for (std::size_t k = 0; k < s.flat_triangles.size(); ++k) {
    const std::uint32_t corner = s.flat_triangles[k];
    mesh.triangles.push_back(s.point_of[corner]);
    if (k % 3 == 0) mesh.shell_of.push_back(s.shell_of[corner]);
  }
  return true;
}

/// Whether a clipped triangle is degenerate or intersects another triangle of the mesh. Only
/// triangles in the layers of clipped triangles at the planes can do so.
bool ClippedTouch(const CutMesh& mesh, PlaneCutScratch& s) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::size_t count = mesh.triangles.size() / 3;
  using Layer = PlaneCutScratch::Layer;
  std::vector<Layer>& layers = s.layers;
  layers.clear();
  for (const CutMesh::Cap& cap : mesh.caps) layers.push_back({cap.plane, kInfinity, -kInfinity});
  const auto range_of = [&](std::size_t t, int axis) {
    const std::uint32_t* const corners = &mesh.triangles[3 * t];
    const double a = Coordinate(mesh, corners[0], axis), b = Coordinate(mesh, corners[1], axis),
                 c = Coordinate(mesh, corners[2], axis);
    return std::array{std::min({a, b, c}), std::max({a, b, c})};
  };
  for (std::size_t t = 0; t < count; ++t) {
    if (mesh.is_clipped[t] == 0) continue;
    // A clipped triangle belongs to the layer of the nearest plane.
    Layer* nearest = nullptr;
    double least = kInfinity;
    std::array<double, 2> range{};
    for (Layer& layer : layers) {
      const auto of = range_of(t, layer.plane.axis);
      const double away = layer.plane.keeps_above ? of[1] - layer.plane.at : layer.plane.at - of[0];
      if (away >= least) continue;
      least = away;
      nearest = &layer;
      range = of;
    }
    if (nearest == nullptr) continue;
    nearest->low = std::min(nearest->low, range[0]);
    nearest->high = std::max(nearest->high, range[1]);
  }
  s.near.clear();
  s.is_new.clear();
  for (std::size_t t = 0; t < count; ++t) {
    const bool is_near =
        mesh.is_clipped[t] != 0 || std::any_of(layers.begin(), layers.end(), [&](const Layer& l) {
          const auto of = range_of(t, l.plane.axis);
          return of[0] <= l.high && of[1] >= l.low;
        });
    if (!is_near) continue;
    s.near.insert(s.near.end(), &mesh.triangles[3 * t], &mesh.triangles[3 * t] + 3);
    s.is_new.push_back(mesh.is_clipped[t]);
  }
  if (s.near.empty()) return false;
  simplify::FindContacts(mesh.points, s.near, s.is_new, s.grid, s.contacts);
  return !s.contacts.empty();
}

}  // namespace

void RemoveCaps(PlaneCutScratch& s, CutMesh& mesh) {
  for (auto cap = mesh.caps.rbegin(); cap != mesh.caps.rend(); ++cap) {
    s.spare_edges.emplace_back().swap(cap->edges);
  }
  mesh.caps.clear();
}

bool CutAtPlane(const AxisPlane& plane, double clearance, PlaneCutScratch& s, CutMesh& mesh) {
  if (!FindSides(plane, clearance, mesh, s)) return false;
  ListCrossedEdges(mesh, s);
  const CrossingPoints crossings(s, static_cast<std::uint32_t>(mesh.points.size() / 3));
  if (!AddCrossings(plane, s, mesh)) return false;
  ClipTriangles(crossings, mesh, s);
  for (CutMesh::Cap& cap : mesh.caps) {
    if (!ClipCap(plane, crossings, mesh, cap, s)) return false;
  }
  CutMesh::Cap& cap = mesh.caps.emplace_back();
  cap.plane = plane;
  if (!s.spare_edges.empty()) {
    cap.edges.swap(s.spare_edges.back());
    s.spare_edges.pop_back();
  }
  cap.edges.assign(s.cap_edges.begin(), s.cap_edges.end());
  return true;
}

bool CapPlanes(double step, PlaneCutScratch& s, CutMesh& mesh) {
  if (ClippedTouch(mesh, s)) return false;
  mesh.cap_offsets.assign(1, static_cast<std::uint32_t>(mesh.triangles.size() / 3));
  for (const CutMesh::Cap& cap : mesh.caps) {
    if (step > 0) s.squares.Find(mesh, cap, step);
    const bool has_squares = step > 0 && !s.squares.empty();
    s.cap_edges.assign(cap.edges.begin(), cap.edges.end());
    if (has_squares) s.squares.AddPoints(cap, mesh, s.cap_edges);
    const bool are_squares_apart = has_squares && TriangulateCap(cap.plane, s.cap_edges, mesh, s);
    if (are_squares_apart) {
      s.squares.AddTriangles(mesh);
    } else if (!TriangulateCap(cap.plane, cap.edges, mesh, s)) {
      return false;
    }
    mesh.cap_offsets.push_back(static_cast<std::uint32_t>(mesh.triangles.size() / 3));
  }
  mesh.is_clipped.resize(mesh.triangles.size() / 3, 0);
  return true;
}

}  // namespace partiemc::space
