#include "simplify/simplify.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bits.h"
#include "base/cancellation.h"
#include "base/parallel.h"
#include "base/vec3.h"
#include "check/shell_nesting.h"
#include "simplify/blocks.h"
#include "simplify/far_points.h"
#include "simplify/mesh_faults.h"
#include "space/lattice.h"
#include "space/mesh.h"

namespace partiemc::simplify {
namespace {

// A shell is simplified at most this many times; then it keeps its certified (given) triangles.
// Each time, the certified triangles near earlier faults stay.
constexpr int kMostAttempts = 6;
// In spacings: the size of the cells that mark where triangles stay, and the margin around a fault,
// which grows by this with each attempt.
constexpr double kCell = 2, kMargin = 1;
// Cell coordinates are clamped to this.
constexpr double kFarthestCell = 1 << 30;
// A shell keeps its certified triangles if one of its faults reaches more cells.
constexpr double kMostCells = 1 << 12;
// Least side of the blocks in which a shell is simplified, in spacings.
constexpr double kLeastBlock = 16;
// In units of WorkLimit. kWorkOfTriangle counts each certified triangle in each round. kWorkOfCell
// counts each cell that a fault marks, where certified triangles stay. It is larger, because a
// marked cell also takes memory.
constexpr std::uint64_t kWorkOfTriangle = 64, kWorkOfCell = 1 << 12;
// A closed surface has at least four triangles.
constexpr std::size_t kLeastIndices = 12;

enum class Progress : std::uint8_t {
  kToSimplify,
  kSimplified,  ///< Not compared with the other shells yet.
  kCompared,
};

/// Simplifies shells, and simplifies those again that break a guarantee. A shell without attempts
/// left keeps its certified triangles, which do not touch each other, so the rounds end.
class Simplifier {
 public:
  Simplifier(const SimplifyLimits& limits, const Surface& certified)
      : limits_(limits),
        certified_(certified),
        shells_(static_cast<std::uint32_t>(certified.ShellCount())),
        triangles_(certified.triangles),
        triangle_count_(shells_, 0),
        changed_count_(shells_, 0),
        attempts_(shells_, 0),
        progress_(shells_, Progress::kToSimplify),
        faults_(shells_) {}

  /// Sets points, triangles, offsets and `outer_of` of `simplified`.
  SimplifyReport Run(Surface& simplified);
  /// By point of the certified surface: its index among the remaining points, or kNoIndex.
  std::span<const std::uint32_t> NewIndices() const { return new_index_; }

 private:
  std::span<const std::uint32_t> CertifiedOf(std::uint32_t shell) const {
    const std::size_t first = certified_.triangle_offsets[shell];
    return std::span(certified_.triangles)
        .subspan(3 * first, 3 * (certified_.triangle_offsets[shell + 1] - first));
  }
  std::span<std::uint32_t> TrianglesOf(std::uint32_t shell) {
    const std::size_t first = certified_.triangle_offsets[shell];
    return std::span(triangles_).subspan(3 * first, 3 * triangle_count_[shell]);
  }
  PointRange PointsOf(std::uint32_t shell) const {
    return {certified_.point_offsets[shell], certified_.point_offsets[shell + 1]};
  }
  space::BrickCoordinate CellOf(const Vec3& at) const {
    const auto along = [this](double value) {
      const double cell = std::floor(value / (kCell * limits_.spacing));
      return static_cast<std::int32_t>(std::clamp(cell, -kFarthestCell, kFarthestCell));
    };
    return {along(at.z), along(at.y), along(at.x)};
  }

  void SimplifyShell(std::uint32_t shell);
  void CopyCertified(std::uint32_t shell);
  void FindFaults(std::uint32_t shell);
  void Compact(Surface& simplified);
  void Count(std::uint64_t work) {
    if (limits_.work != nullptr) limits_.work->Take(work);
  }

  /// Marks the cells near a fault of a shell. The next round then simplifies the shell again.
  void Repeat(std::uint32_t shell, const Box& fault);
  /// Marks a shell whose certified triangles the next round copies.
  void GiveUp(std::uint32_t shell) {
    attempts_[shell] = kMostAttempts;
    progress_[shell] = Progress::kToSimplify;
  }

  // These return whether another round must follow.
  bool RepeatFaultyShells();
  bool RepeatTouchingShells(const Surface& simplified);
  bool GiveUpMovedShells(const Surface& simplified);

  const SimplifyLimits limits_;
  const Surface& certified_;
  const std::uint32_t shells_;
  /// The current triangles, with indices of the certified surface's points. The triangles of a
  /// shell begin where its certified triangles do.
  std::vector<std::uint32_t> triangles_;
  std::vector<std::size_t> triangle_count_;  // By shell, as all below.
  /// The number of triangles that may differ from the certified ones. These triangles come first.
  std::vector<std::size_t> changed_count_;
  std::vector<int> attempts_;  // Above kMostAttempts: the shell has its certified triangles.
  std::vector<Progress> progress_;
  std::vector<std::vector<Box>> faults_;
  space::BrickDirectory kept_cells_;   // Certified triangles with a point in these stay.
  std::vector<std::uint32_t> around_;  // By shell: the certified shell around it.
  std::vector<std::uint32_t> new_index_;
};

void Simplifier::CopyCertified(std::uint32_t shell) {
  const std::span<const std::uint32_t> certified = CertifiedOf(shell);
  triangle_count_[shell] = certified.size() / 3;
  changed_count_[shell] = 0;
  std::ranges::copy(certified, TrianglesOf(shell).begin());
  attempts_[shell] = kMostAttempts + 1;
}

void Simplifier::SimplifyShell(std::uint32_t shell) {
  progress_[shell] = Progress::kSimplified;
  Count(kWorkOfTriangle * (CertifiedOf(shell).size() / 3));
  if (attempts_[shell] >= kMostAttempts) return CopyCertified(shell);
  const auto [first, last] = PointsOf(shell);
  const std::span<const std::uint32_t> certified = CertifiedOf(shell);
  std::vector<std::uint8_t> stays(last - first, 0);
  for (std::uint32_t k = first; k < last && kept_cells_.size() > 0; ++k) {
    const space::BrickCoordinate cell = CellOf(Vec3At(certified_.points, k));
    stays[k - first] = kept_cells_.Find(cell) != kNoIndex ? 1 : 0;
  }
  std::vector<std::uint32_t> changed, kept;
  for (std::size_t t = 0; t < certified.size(); t += 3) {
    const std::uint32_t a = certified[t], b = certified[t + 1], c = certified[t + 2];
    const bool is_kept = stays[a - first] != 0 || stays[b - first] != 0 || stays[c - first] != 0;
    auto& to = is_kept ? kept : changed;
    to.insert(to.end(), {a, b, c});
  }
  // Points on the border of the changed triangles stay, so the kept triangles fit.
  SimplifyInBlocks(certified_.points,
                   {.error = limits_.error, .least_block = kLeastBlock * limits_.spacing}, changed);
  const std::size_t indices = changed.size() + kept.size();
  if (indices < kLeastIndices) return CopyCertified(shell);
  ++attempts_[shell];
  triangle_count_[shell] = indices / 3;
  changed_count_[shell] = changed.size() / 3;
  std::ranges::copy(kept, std::ranges::copy(changed, TrianglesOf(shell).begin()).out);
}

void Simplifier::FindFaults(std::uint32_t shell) {
  std::vector<Box>& faults = faults_[shell];
  faults.clear();
  const std::span<const std::uint32_t> triangles = TrianglesOf(shell);
  FindManifoldFaults(certified_.points, triangles, faults);
  if (!faults.empty()) return;
  const PointRange range = PointsOf(shell);
  std::vector<std::uint32_t> far;
  FindFarPoints(certified_.points, range, triangles, kFarthest * limits_.error, limits_.spacing,
                far, limits_.work);
  for (const std::uint32_t point : far) {
    const Vec3 at = Vec3At(certified_.points, point);
    faults.push_back({at, at});
  }
  if (!faults.empty()) return;
  // If the shell keeps its handles, each removed point takes two triangles with it.
  const std::size_t removed = (CertifiedOf(shell).size() - triangles.size()) / 3;
  const std::size_t points = range.last - range.first - removed / 2;
  if (removed % 2 != 0 || !IsConnected(triangles, points)) {
    faults.push_back(BoxOf(certified_.points, triangles));
  }
}

void Simplifier::Repeat(std::uint32_t shell, const Box& fault) {
  progress_[shell] = Progress::kToSimplify;
  if (attempts_[shell] >= kMostAttempts) return;
  const double margin = kMargin * attempts_[shell] * limits_.spacing;
  const space::BrickCoordinate low = CellOf(fault.low - Vec3{margin, margin, margin});
  const space::BrickCoordinate high = CellOf(fault.high + Vec3{margin, margin, margin});
  const double cells = (1.0 + high.x - low.x) * (1.0 + high.y - low.y) * (1.0 + high.z - low.z);
  if (cells > kMostCells) return GiveUp(shell);
  const std::size_t before = kept_cells_.size();
  for (std::int32_t z = low.z; z <= high.z; ++z) {
    for (std::int32_t y = low.y; y <= high.y; ++y) {
      for (std::int32_t x = low.x; x <= high.x; ++x) kept_cells_.Insert({z, y, x});
    }
  }
  Count(static_cast<std::uint64_t>(8 * cells) + kWorkOfCell * (kept_cells_.size() - before));
}

bool Simplifier::RepeatFaultyShells() {
  ParallelFor(shells_, [&](std::uint32_t shell) {
    const bool is_certified = attempts_[shell] > kMostAttempts;
    faults_[shell].clear();
    if (progress_[shell] == Progress::kSimplified && !is_certified) FindFaults(shell);
  });
  bool is_faulty = false;
  for (std::uint32_t shell = 0; shell < shells_; ++shell) {
    for (const Box& fault : faults_[shell]) Repeat(shell, fault);
    is_faulty = is_faulty || !faults_[shell].empty();
  }
  return is_faulty;
}

void Simplifier::Compact(Surface& simplified) {
  Count(kWorkOfTriangle * certified_.TriangleCount());
  simplified.triangles.clear();
  simplified.triangle_offsets = {0};
  for (std::uint32_t shell = 0; shell < shells_; ++shell) {
    const std::span<const std::uint32_t> triangles = TrianglesOf(shell);
    simplified.triangles.insert(simplified.triangles.end(), triangles.begin(), triangles.end());
    simplified.triangle_offsets.push_back(static_cast<std::uint32_t>(simplified.TriangleCount()));
  }
  new_index_.assign(certified_.PointCount(), kNoIndex);
  for (const std::uint32_t point : simplified.triangles) new_index_[point] = 0;
  simplified.points.clear();
  simplified.point_offsets = {0};
  for (std::uint32_t shell = 0; shell < shells_; ++shell) {
    const auto [first, last] = PointsOf(shell);
    for (std::uint32_t k = first; k < last; ++k) {
      if (new_index_[k] == kNoIndex) continue;
      new_index_[k] = static_cast<std::uint32_t>(simplified.PointCount());
      const Vec3 at = Vec3At(certified_.points, k);
      simplified.points.insert(simplified.points.end(), {at.x, at.y, at.z});
    }
    simplified.point_offsets.push_back(static_cast<std::uint32_t>(simplified.PointCount()));
  }
  for (std::uint32_t& point : simplified.triangles) point = new_index_[point];
  simplified.outer_of = certified_.outer_of;
}

bool Simplifier::RepeatTouchingShells(const Surface& simplified) {
  std::vector<std::uint32_t> shell_of;
  std::vector<std::uint8_t> kinds;
  for (std::uint32_t shell = 0; shell < shells_; ++shell) {
    const std::size_t last = simplified.triangle_offsets[shell + 1];
    const bool is_new = progress_[shell] == Progress::kSimplified;
    shell_of.resize(last, shell);
    kinds.resize(kinds.size() + changed_count_[shell], is_new ? kNew : kChanged);
    kinds.resize(last, is_new ? kKept : kOld);
  }
  std::vector<Contact> contacts;
  TriangleGrid grid;
  FindContacts(simplified.points, simplified.triangles, kinds, grid, contacts, limits_.work);
  // While there are degenerate triangles, no pairs are compared.
  const bool has_compared = contacts.empty() || contacts[0].a != contacts[0].b;
  for (std::uint32_t shell = 0; shell < shells_ && has_compared; ++shell) {
    progress_[shell] = Progress::kCompared;
  }
  for (const Contact& contact : contacts) {
    for (const std::uint32_t triangle : {contact.a, contact.b}) {
      const std::uint32_t shell = shell_of[triangle];
      // A certified shell stays as it is, because the other triangle is at fault.
      if (attempts_[shell] <= kMostAttempts) Repeat(shell, contact.box);
    }
  }
  return !contacts.empty();
}

/// Gives up shells that were turned inside out or have passed another shell, and the shells around
/// them; all shells if these were given up before. A shell that passed another shell may not touch
/// that shell now, so RepeatTouchingShells may miss it.
bool Simplifier::GiveUpMovedShells(const Surface& simplified) {
  if (around_.empty()) around_ = ShellsAround(certified_, limits_.work);
  const std::vector<int> turns = OrientationsOf(simplified);
  const std::vector<std::uint32_t> around = ShellsAround(simplified, limits_.work);
  bool has_moved = false, gives_up = false;
  const auto give_up = [&](std::uint32_t shell) {
    if (shell == kNoShell || attempts_[shell] > kMostAttempts) return;
    GiveUp(shell);
    gives_up = true;
  };
  for (std::uint32_t shell = 0; shell < shells_; ++shell) {
    const int turn = certified_.outer_of[shell] == kNoShell ? 1 : -1;
    if (turns[shell] == turn && around[shell] == around_[shell]) continue;
    has_moved = true;
    for (const std::uint32_t involved : {shell, around[shell], around_[shell]}) give_up(involved);
  }
  if (has_moved && !gives_up) {
    for (std::uint32_t shell = 0; shell < shells_; ++shell) give_up(shell);
  }
  return gives_up;
}

SimplifyReport Simplifier::Run(Surface& simplified) {
  do {
    do {
      ThrowIfCancelled();
      Count(shells_);
      ParallelFor(shells_, [&](std::uint32_t shell) {
        if (progress_[shell] == Progress::kToSimplify) SimplifyShell(shell);
      });
    } while (RepeatFaultyShells());
    ThrowIfCancelled();
    Compact(simplified);
  } while (RepeatTouchingShells(simplified) || GiveUpMovedShells(simplified));
  SimplifyReport report;
  for (const int attempts : attempts_) {
    report.repeated_shells += attempts > 1 ? 1 : 0;
    report.certified_shells += attempts > kMostAttempts ? 1 : 0;
  }
  return report;
}

// Removes the values of removed points. Each point has `components` values, or `values` is empty.
void KeepValues(std::span<const std::uint32_t> new_index, std::size_t components,
                std::vector<float>& values) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < new_index.size(); ++k) {
    if (new_index[k] == kNoIndex) continue;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(components * k), components,
                values.begin() + static_cast<std::ptrdiff_t>(components * new_index[k]));
    ++kept;
  }
  values.resize(components * kept);
}

}  // namespace

SimplifyReport Simplify(const SimplifyLimits& limits, Surface& surface) {
  if (surface.ShellCount() == 0) return {};
  Surface simplified;
  Simplifier simplifier(limits, surface);
  const SimplifyReport report = simplifier.Run(simplified);
  const std::span<const std::uint32_t> new_index = simplifier.NewIndices();
  KeepValues(new_index, 3, surface.normals);
  for (AttributeValues& attribute : surface.attributes) {
    KeepValues(new_index, static_cast<std::size_t>(attribute.components), attribute.values);
  }
  surface.points.assign(simplified.points.begin(), simplified.points.end());
  surface.triangles.assign(simplified.triangles.begin(), simplified.triangles.end());
  surface.point_offsets.assign(simplified.point_offsets.begin(), simplified.point_offsets.end());
  surface.triangle_offsets.assign(simplified.triangle_offsets.begin(),
                                  simplified.triangle_offsets.end());
  surface.cuts.clear();
  for (std::uint32_t shell = 0; shell < surface.ShellCount(); ++shell) {
    space::MeasureShell(shell, surface);
  }
  return report;
}

}  // namespace partiemc::simplify
