#include "space_cut/surface_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "base/bits.h"
#include "base/cancellation.h"
#include "base/predicates_in_space.h"
#include "check/shell_nesting.h"
#include "space/mesh.h"

namespace partiemc::space {
namespace {

// The moves of planes, in steps, one for each try. A step is kShiftSpacings spacings plus
// kShiftBits last bits of the coordinate.
constexpr std::array kShifts = {0.,   1.,   2.,   3.,    5.,    8.,     13.,    21.,    55.,
                                144., 377., 987., 2584., 6765., 17711., 46368., 121393.};
// Walls use only the first ones: a larger move could bring them to other shells.
constexpr std::size_t kShiftsOfWalls = 15;
constexpr double kShiftSpacings = 1e-9, kShiftBits = 64;
// Factors by axis. With equal moves along two axes, the crossing line of two planes would follow
// diagonal edges of bodies on a lattice.
constexpr std::array kShiftAlong = {1., 1.37, 1.71};
// Points closer to a plane than this part of a step are too close. It is small because the vertices
// of a flat face in the plane are up to 1e-7 spacings away.
constexpr double kClearance = 1. / 256;
// A piece is dust if its volume is below this part of the cube of its size, or if its size is below
// this part of its distance from the origin. Rounding hides its volume or its centroid.
constexpr double kLeastVolume = 1e-14, kLeastSize = 1e-9;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool IsCut(const SurfaceCutInput& input, std::size_t shell) {
  return input.is_cut.empty() || input.is_cut[shell] != 0;
}

std::uint32_t OuterOf(const Surface& surface, std::uint32_t shell) {
  return surface.outer_of[shell] == kNoShell ? shell : surface.outer_of[shell];
}

std::uint32_t BodyOf(const SurfaceCutInput& input, const Surface& surface, std::uint32_t shell) {
  return input.body_of.empty() ? OuterOf(surface, shell) : input.body_of[shell];
}

// CutMesh::shell_of of a triangle: its shell, and whether it is in Surface::cuts.
std::uint32_t NumberOf(std::uint32_t shell, bool is_listed) {
  return 2 * shell + (is_listed ? 1 : 0);
}
std::uint32_t ShellOf(std::uint32_t number) { return number / 2; }
bool IsListed(std::uint32_t number) { return number % 2 != 0; }

void AddShell(const Surface& surface, std::uint32_t shell, CutMesh& mesh) {
  const std::size_t first = surface.triangle_offsets[shell];
  const std::size_t last = surface.triangle_offsets[shell + 1];
  mesh.triangles.insert(mesh.triangles.end(), surface.triangles.begin() + 3 * first,
                        surface.triangles.begin() + 3 * last);
  for (std::size_t t = first; t < last; ++t) {
    mesh.shell_of.push_back(
        NumberOf(shell, std::binary_search(surface.cuts.begin(), surface.cuts.end(), t)));
  }
}

void FillMesh(const SurfaceCutInput& input, const Surface& surface, PlaneCutScratch& plane,
              CutMesh& mesh) {
  mesh.points = surface.points;
  mesh.normals = surface.normals;
  mesh.triangles.clear();
  mesh.shell_of.clear();
  RemoveCaps(plane, mesh);
  for (std::uint32_t shell = 0; shell < surface.ShellCount(); ++shell) {
    if (IsCut(input, shell)) AddShell(surface, shell, mesh);
  }
  mesh.is_clipped.assign(mesh.shell_of.size(), 0);
}

/// The moves of a try, as indices of kShifts.
struct Moves {
  std::size_t faces = 0, walls = 0;
};

/// Moves each plane as `moves` states, cuts the mesh at all planes, and triangulates the caps. If a
/// cut fails, returns false and advances the move for this kind of plane only (faces or walls):
/// walls stay at rest if possible, because the points on a moved wall must return to the wall. If
/// the caps fail, advances both moves.
bool CutAtPlanes(const SurfaceCutInput& input, Moves& moves, SurfaceCutScratch& s) {
  std::array<double, 3> farthest{};
  for (const AxisPlane& plane : input.planes) {
    double& far = farthest[static_cast<std::size_t>(plane.axis)];
    far = std::max(far, std::abs(plane.at));
  }
  for (AxisPlane plane : input.planes) {
    ThrowIfCancelled();
    // Opposite faces of a box move alike. A wall moves alone: the opposite one may be far away.
    const double far =
        plane.is_wall ? std::abs(plane.at) : farthest[static_cast<std::size_t>(plane.axis)];
    const double step =
        kShiftSpacings * input.spacing + kShiftBits * std::numeric_limits<double>::epsilon() * far;
    std::size_t& of_plane = plane.is_wall ? moves.walls : moves.faces;
    const double move =
        kShifts[of_plane] * step * kShiftAlong[static_cast<std::size_t>(plane.axis)];
    plane.at += plane.is_wall && !plane.keeps_above ? -move : move;
    if (!InSpaceDomain(plane.at)) plane.at = 0;
    if (CutAtPlane(plane, kClearance * step, s.plane, s.mesh)) continue;
    ++of_plane;
    return false;
  }
  if (CapPlanes(input.inner_step, s.plane, s.mesh)) return true;
  ++moves.faces;
  ++moves.walls;
  return false;
}

/// Moves the points of caps on walls to the given planes.
void ReturnToWalls(const SurfaceCutInput& input, CutMesh& mesh) {
  for (std::size_t cap = 0; cap < input.planes.size(); ++cap) {
    const AxisPlane& plane = input.planes[cap];
    if (!plane.is_wall) continue;
    for (std::size_t k = 3 * std::size_t{mesh.cap_offsets[cap]};
         k < 3 * std::size_t{mesh.cap_offsets[cap + 1]}; ++k) {
      mesh.points[3 * std::size_t{mesh.triangles[k]} + static_cast<std::size_t>(plane.axis)] =
          plane.at;
    }
  }
}

/// Writes the new surface: the shells that are not cut, and the connected parts of the mesh.
class Assembly {
 public:
  Assembly(const SurfaceCutInput& input, const Surface& from, SurfaceCutScratch& s,
           SurfacePieces& pieces)
      : input_(input), from_(from), s_(s), to_(s.surface), pieces_(pieces) {}

  void Run() {
    AddWholeTriangles();
    FindPieces();
    if (DropDust()) FindPieces();
    CopyPoints();
    CopyTriangles();
    Measure();
    Nest();
    WriteParents();
  }

 private:
  // Pieces are in the order of their first points, so shells that are not cut become pieces, too.
  void AddWholeTriangles();
  void FindPieces();
  bool DropDust();
  void CopyPoints();
  void CopyTriangles();
  void Measure();
  void Nest();
  void NameLargest();
  void WriteParents();

  std::size_t Cut() const { return s_.mesh.cap_offsets.front(); }  // The first triangle of a cap.

  const SurfaceCutInput& input_;
  const Surface& from_;
  SurfaceCutScratch& s_;
  Surface& to_;
  SurfacePieces& pieces_;
  std::size_t first_whole_ = 0;  // Triangles of shells that are not cut, in the mesh.
};

void Assembly::AddWholeTriangles() {
  CutMesh& mesh = s_.mesh;
  first_whole_ = mesh.triangles.size() / 3;
  for (std::uint32_t shell = 0; shell < from_.ShellCount(); ++shell) {
    if (!IsCut(input_, shell)) AddShell(from_, shell, mesh);
  }
}

/// Numbers the connected parts, the pieces, in the order of their first points.
void Assembly::FindPieces() {
  const CutMesh& mesh = s_.mesh;
  const auto points = static_cast<std::uint32_t>(mesh.points.size() / 3);
  s_.parent.resize(points);
  for (std::uint32_t point = 0; point < points; ++point) s_.parent[point] = point;
  s_.piece_of.assign(points, kNoIndex);
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    for (int corner = 0; corner < 3; ++corner) {
      s_.piece_of[mesh.triangles[k + corner]] = 0;
      const std::uint32_t a = RootOf(s_.parent, mesh.triangles[k]);
      const std::uint32_t b = RootOf(s_.parent, mesh.triangles[k + corner]);
      s_.parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::uint32_t pieces = 0;
  for (std::uint32_t point = 0; point < points; ++point) {
    if (s_.piece_of[point] == kNoIndex) continue;
    const std::uint32_t root = RootOf(s_.parent, point);
    s_.piece_of[point] = root == point ? pieces++ : s_.piece_of[root];
  }
  pieces_.sources.assign(pieces, kNoShell);
  pieces_.has_cuts.assign(pieces, 0);
  for (std::size_t t = 0; t < mesh.shell_of.size(); ++t) {
    const std::uint32_t piece = s_.piece_of[mesh.triangles[3 * t]];
    pieces_.sources[piece] = ShellOf(mesh.shell_of[t]);
    if (t >= Cut() && t < first_whole_) pieces_.has_cuts[piece] = 1;
  }
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    if (pieces_.has_cuts[piece] == 0) continue;
    pieces_.sources[piece] = OuterOf(from_, pieces_.sources[piece]);
  }
}

/// Removes the triangles of dust. Returns whether there is any.
bool Assembly::DropDust() {
  CutMesh& mesh = s_.mesh;
  using Size = SurfaceCutScratch::PieceSize;
  std::vector<Size>& sizes = s_.sizes;
  sizes.assign(
      pieces_.sources.size(),
      {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}, {}, 0, false});
  for (std::size_t point = 0; point < s_.piece_of.size(); ++point) {
    if (s_.piece_of[point] == kNoIndex) continue;
    const Vec3 at = Vec3At(mesh.points, point);
    Size& size = sizes[s_.piece_of[point]];
    size.origin = at;
    size.low = Lower(size.low, at);
    size.high = Upper(size.high, at);
  }
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    Size& size = sizes[s_.piece_of[mesh.triangles[k]]];
    const Vec3 a = Vec3At(mesh.points, mesh.triangles[k]) - size.origin;
    const Vec3 b = Vec3At(mesh.points, mesh.triangles[k + 1]) - size.origin;
    const Vec3 c = Vec3At(mesh.points, mesh.triangles[k + 2]) - size.origin;
    size.volume += Dot(a, Cross(b, c)) / 6;
  }
  bool any = false;
  for (std::size_t piece = 0; piece < sizes.size(); ++piece) {
    Size& size = sizes[piece];
    const double across = Length(size.high - size.low);
    size.is_dust =
        pieces_.has_cuts[piece] != 0 && !(size.volume > kLeastVolume * across * across * across &&
                                          across > kLeastSize * Length(size.origin));
    any = any || size.is_dust;
  }
  if (!any) return false;
  std::size_t kept = 0, caps = 0, whole = 0;
  for (std::size_t t = 0; t < mesh.shell_of.size(); ++t) {
    if (t == Cut()) caps = kept;
    if (t == first_whole_) whole = kept;
    if (sizes[s_.piece_of[mesh.triangles[3 * t]]].is_dust) continue;
    std::copy_n(mesh.triangles.begin() + 3 * t, 3, mesh.triangles.begin() + 3 * kept);
    mesh.shell_of[kept++] = mesh.shell_of[t];
  }
  if (first_whole_ == mesh.shell_of.size()) whole = kept;
  mesh.cap_offsets.front() = static_cast<std::uint32_t>(caps);
  first_whole_ = whole;
  mesh.triangles.resize(3 * kept);
  mesh.shell_of.resize(kept);
  return true;
}

/// Turns counts at index k + 1 into offsets, and copies these to `next`.
void SumUp(std::vector<std::uint32_t>& offsets, std::vector<std::uint32_t>& next) {
  for (std::size_t k = 1; k < offsets.size(); ++k) offsets[k] += offsets[k - 1];
  next.assign(offsets.begin(), offsets.end());
}

void Assembly::CopyPoints() {
  const CutMesh& mesh = s_.mesh;
  to_.point_offsets.assign(pieces_.sources.size() + 1, 0);
  for (const std::uint32_t piece : s_.piece_of) {
    if (piece != kNoIndex) ++to_.point_offsets[piece + 1];
  }
  SumUp(to_.point_offsets, s_.next);
  to_.points.resize(3 * std::size_t{to_.point_offsets.back()});
  to_.normals.resize(to_.points.size());
  s_.point_of.resize(s_.piece_of.size());
  for (std::size_t point = 0; point < s_.piece_of.size(); ++point) {
    if (s_.piece_of[point] == kNoIndex) continue;
    const std::size_t at = s_.point_of[point] = s_.next[s_.piece_of[point]]++;
    std::copy_n(mesh.points.begin() + 3 * point, 3, to_.points.begin() + 3 * at);
    std::copy_n(mesh.normals.begin() + 3 * point, 3, to_.normals.begin() + 3 * at);
  }
}

/// Copies the triangles of each piece, the triangles on planes last. Lists in Surface::cuts the
/// triangles on planes, and the triangles that the given surface has listed there.
void Assembly::CopyTriangles() {
  const CutMesh& mesh = s_.mesh;
  to_.triangle_offsets.assign(pieces_.sources.size() + 1, 0);
  const std::size_t count = mesh.shell_of.size();
  for (std::size_t t = 0; t < count; ++t) {
    ++to_.triangle_offsets[s_.piece_of[mesh.triangles[3 * t]] + 1];
  }
  SumUp(to_.triangle_offsets, s_.next);
  to_.triangles.resize(mesh.triangles.size());
  to_.cuts.clear();
  const auto copy = [&](std::size_t first, std::size_t last, bool is_on_plane) {
    for (std::size_t t = first; t < last; ++t) {
      const std::uint32_t at = s_.next[s_.piece_of[mesh.triangles[3 * t]]]++;
      for (std::size_t k = 0; k < 3; ++k) {
        to_.triangles[3 * std::size_t{at} + k] = s_.point_of[mesh.triangles[3 * t + k]];
      }
      if (is_on_plane || IsListed(mesh.shell_of[t])) to_.cuts.push_back(at);
    }
  };
  copy(0, Cut(), false);
  copy(first_whole_, count, false);
  copy(Cut(), first_whole_, true);
  std::sort(to_.cuts.begin(), to_.cuts.end());
}

void Assembly::Measure() {
  to_.measures.assign(pieces_.sources.size(), {});
  for (std::uint32_t piece = 0; piece < pieces_.sources.size(); ++piece) {
    ShellMeasures& measures = to_.measures[piece];
    if (pieces_.has_cuts[piece] == 0) {
      measures = from_.measures[pieces_.sources[piece]];
      continue;
    }
    MeasureShell(piece, to_);
  }
  NameLargest();
}

/// Gives the largest piece of each cut body the body's particles and identity, other pieces none.
void Assembly::NameLargest() {
  std::vector<std::uint32_t>& largest = s_.largest;
  largest.assign(from_.ShellCount(), kNoShell);
  const auto is_part = [&](std::uint32_t piece) {
    const std::uint32_t source = pieces_.sources[piece];
    return IsCut(input_, source) && from_.outer_of[source] == kNoShell;
  };
  for (std::uint32_t piece = 0; piece < pieces_.sources.size(); ++piece) {
    if (!is_part(piece)) continue;
    std::uint32_t& first = largest[BodyOf(input_, from_, pieces_.sources[piece])];
    if (first == kNoShell || to_.measures[piece].volume > to_.measures[first].volume) first = piece;
  }
  for (std::uint32_t piece = 0; piece < pieces_.sources.size(); ++piece) {
    if (!is_part(piece)) continue;
    const std::uint32_t body = BodyOf(input_, from_, pieces_.sources[piece]);
    const bool is_largest = largest[body] == piece;
    to_.measures[piece].particles = is_largest ? from_.measures[body].particles : 0;
    to_.measures[piece].identity = is_largest ? from_.measures[body].identity : 0;
  }
}

/// Sets outer_of. A piece with triangles on a plane borders on the outside, so it is no cavity.
void Assembly::Nest() {
  const auto pieces = static_cast<std::uint32_t>(pieces_.sources.size());
  // `only` of a shell is kNoShell if the shell has no outer piece, kSeveral if it has several.
  constexpr std::uint32_t kSeveral = kNoIndex - 1;
  std::vector<std::uint32_t>& only = s_.only;
  only.assign(from_.ShellCount(), kNoShell);
  const auto is_cavity = [&](std::uint32_t piece) {
    return pieces_.has_cuts[piece] == 0 && from_.outer_of[pieces_.sources[piece]] != kNoShell;
  };
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    if (is_cavity(piece)) continue;
    std::uint32_t& of = only[pieces_.sources[piece]];
    of = of == kNoShell ? piece : kSeveral;
  }
  to_.outer_of.assign(pieces, kNoShell);
  bool is_open = false;
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    if (!is_cavity(piece)) continue;
    to_.outer_of[piece] = only[from_.outer_of[pieces_.sources[piece]]];
    is_open = is_open || to_.outer_of[piece] == kSeveral;
  }
  if (!is_open) return;
  const std::vector<std::uint32_t> around = ShellsAround(to_);
  for (std::uint32_t piece = 0; piece < pieces; ++piece) {
    if (to_.outer_of[piece] == kSeveral) to_.outer_of[piece] = around[piece];
  }
}

void Assembly::WriteParents() {
  to_.parents.clear();
  to_.parent_offsets.assign(1, 0);
  if (from_.parent_offsets.size() == 1) return;
  for (std::uint32_t piece = 0; piece < pieces_.sources.size(); ++piece) {
    std::uint32_t shell = pieces_.sources[piece];
    bool has_parents = true;
    if (IsCut(input_, shell) && from_.outer_of[shell] == kNoShell) {
      shell = BodyOf(input_, from_, shell);
      has_parents = s_.largest[shell] == piece;
    }
    if (has_parents) {
      const auto parents = from_.ParentsOf(shell);
      to_.parents.insert(to_.parents.end(), parents.begin(), parents.end());
    }
    to_.parent_offsets.push_back(static_cast<std::uint32_t>(to_.parents.size()));
  }
}

}  // namespace

bool CutSurface(const SurfaceCutInput& input, SurfaceCutScratch& s, SurfacePieces& pieces,
                Surface& surface) {
  const bool has_walls = std::ranges::any_of(input.planes, &AxisPlane::is_wall);
  const std::size_t most = has_walls ? kShiftsOfWalls : kShifts.size();
  // With walls, the second half of the tries leaves the points where the cuts are.
  for (const bool may_return : {true, false}) {
    for (Moves moves; moves.faces < most && moves.walls < most;) {
      ThrowIfCancelled();
      const bool returns = may_return && moves.walls > 0;
      FillMesh(input, surface, s.plane, s.mesh);
      if (!CutAtPlanes(input, moves, s)) continue;
      if (returns) ReturnToWalls(input, s.mesh);
      Assembly(input, surface, s, pieces).Run();
      if (returns && !Validate(s.surface).ok()) {
        ++moves.walls;
        continue;
      }
      s.surface.statistics = surface.statistics;
      std::swap(s.surface.attributes, surface.attributes);
      std::swap(s.surface, surface);
      return true;
    }
    if (!has_walls) break;
  }
  return false;
}

}  // namespace partiemc::space
