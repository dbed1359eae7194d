#include "space_cut/cap_squares.h"

#include <algorithm>
#include <cmath>

namespace partiemc::space {
namespace {

constexpr double kMostSteps = 1 << 30;
constexpr double kMargin = .25;  // In steps.
// Each round drops squares that touch others only at corners. A cap that needs more rounds gets no
// squares.
constexpr int kMostRounds = 8;

}  // namespace

void CapSquares::ListRows(const CutMesh& mesh, const CutMesh::Cap& cap) {
  const std::array<int, 2> frame = PlaneFrame(cap.plane);
  const auto place_of = [&](std::uint32_t point) {
    const double* const at = mesh.points.data() + 3 * std::size_t{point};
    return std::array{at[frame[0]] / step_, at[frame[1]] / step_};
  };
  rows_.clear();
  for (const CutMesh::CapEdge& edge : cap.edges) {
    const auto [from_x, from_y] = place_of(edge.from);
    const auto [to_x, to_y] = place_of(edge.to);
    const bool is_near =
        std::max({std::abs(from_x), std::abs(from_y), std::abs(to_x), std::abs(to_y)}) < kMostSteps;
    if (!is_near) {
      rows_.clear();
      return;
    }
    const auto low = [](double a, double b) {
      return static_cast<std::int32_t>(std::floor(std::min(a, b) - kMargin));
    };
    const auto high = [](double a, double b) {
      return static_cast<std::int32_t>(std::floor(std::max(a, b) + kMargin));
    };
    for (std::int32_t row = low(from_y, to_y); row <= high(from_y, to_y); ++row) {
      const double middle = row + .5;
      const bool crosses = (from_y < middle) != (to_y < middle);
      const double at =
          crosses ? from_x + (middle - from_y) / (to_y - from_y) * (to_x - from_x) : 0;
      // The cap is on the left of its edges, so it is right of an edge that goes down.
      rows_.push_back(
          {row, low(from_x, to_x), high(from_x, to_x), edge.shell, crosses, to_y < from_y, at});
    }
  }
  std::sort(rows_.begin(), rows_.end(), [](const RowEdge& a, const RowEdge& b) {
    return a.row != b.row ? a.row < b.row : a.first < b.first;
  });
}

/// Adds the squares of a row. `edges`: the edges near the row, sorted by their first columns.
void CapSquares::FillRow(std::span<RowEdge> edges) {
  crossings_.clear();
  for (const RowEdge& edge : edges) {
    if (edge.crosses) crossings_.push_back(edge);
  }
  std::sort(crossings_.begin(), crossings_.end(),
            [](const RowEdge& a, const RowEdge& b) { return a.at < b.at; });
  // If rounding puts two crossings in the wrong order, all columns between them are near both
  // edges. Such columns get no square.
  int depth = 0;
  std::uint32_t shell = 0;  // Of the last entry.
  std::size_t next = 0;
  std::int32_t free = 0;  // With `has_free`: the first column right of all edges before `next`.
  bool has_free = false;
  for (std::size_t k = 0; k + 1 < crossings_.size(); ++k) {
    depth += crossings_[k].is_entry ? 1 : -1;
    if (crossings_[k].is_entry) shell = crossings_[k].shell;
    if (depth != 1) continue;
    auto column = static_cast<std::int32_t>(std::floor(crossings_[k].at));
    const auto end = static_cast<std::int32_t>(std::floor(crossings_[k + 1].at));
    for (; column <= end; ++column) {
      for (; next < edges.size() && edges[next].first <= column; ++next) {
        free = has_free ? std::max(free, edges[next].last + 1) : edges[next].last + 1;
        has_free = true;
      }
      if (has_free && column < free) {
        column = std::min(free, end + 1) - 1;
        continue;
      }
      squares_.push_back({{edges[0].row, column}, shell});
    }
  }
}

bool CapSquares::Has(const Place& at) const {
  const auto found =
      std::lower_bound(squares_.begin(), squares_.end(), at,
                       [](const Square& square, const Place& place) { return square.at < place; });
  return found != squares_.end() && found->at == at;
}

/// Drops both squares of each pair that touches at a corner without a third square beside both.
/// Returns true if there was no such pair.
bool CapSquares::DropPinches() {
  pinched_.assign(squares_.size(), 0);
  bool any = false;
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    const auto [row, column] = squares_[k].at;
    for (const int up : {-1, 1}) {
      for (const int right : {-1, 1}) {
        if (!Has({row + up, column + right}) || Has({row + up, column}) ||
            Has({row, column + right})) {
          continue;
        }
        pinched_[k] = 1;
        any = true;
      }
    }
  }
  if (!any) return true;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < squares_.size(); ++k) {
    if (pinched_[k] == 0) squares_[kept++] = squares_[k];
  }
  squares_.resize(kept);
  return false;
}

void CapSquares::Find(const CutMesh& mesh, const CutMesh::Cap& cap, double step) {
  step_ = step;
  squares_.clear();
  ListRows(mesh, cap);
  for (std::size_t first = 0, end = 0; first < rows_.size(); first = end) {
    while (end < rows_.size() && rows_[end].row == rows_[first].row) ++end;
    FillRow(std::span(rows_).subspan(first, end - first));
  }
  for (int round = 0; !DropPinches(); ++round) {
    if (round == kMostRounds) squares_.clear();
  }
}

std::uint32_t CapSquares::PointAt(const Place& at) const {
  const auto found = std::lower_bound(corners_.begin(), corners_.end(), at);
  return first_point_ + static_cast<std::uint32_t>(found - corners_.begin());
}

void CapSquares::AddPoints(const CutMesh::Cap& cap, CutMesh& mesh,
                           std::vector<CutMesh::CapEdge>& edges) {
  corners_.clear();
  for (const auto& [at, shell] : squares_) {
    for (int corner = 0; corner < 4; ++corner) {
      corners_.push_back({at.row + (corner >> 1), at.column + (corner & 1)});
    }
  }
  std::sort(corners_.begin(), corners_.end());
  corners_.erase(std::unique(corners_.begin(), corners_.end()), corners_.end());
  first_point_ = static_cast<std::uint32_t>(mesh.points.size() / 3);
  const std::array<int, 2> frame = PlaneFrame(cap.plane);
  for (const Place& corner : corners_) {
    std::array<double, 3> point{};
    point[cap.plane.axis] = cap.plane.at;
    point[frame[0]] = step_ * corner.column;
    point[frame[1]] = step_ * corner.row;
    mesh.points.insert(mesh.points.end(), point.begin(), point.end());
    std::array<float, 3> normal{};
    normal[cap.plane.axis] = cap.plane.keeps_above ? -1 : 1;
    mesh.normals.insert(mesh.normals.end(), normal.begin(), normal.end());
  }
  for (const Square& square : squares_) {
    const auto [row, column] = square.at;
    const auto add = [&](const Place& beside, const Place& from, const Place& to) {
      if (!Has(beside)) edges.push_back({PointAt(from), PointAt(to), square.shell});
    };
    add({row - 1, column}, {row, column + 1}, {row, column});
    add({row, column + 1}, {row + 1, column + 1}, {row, column + 1});
    add({row + 1, column}, {row + 1, column}, {row + 1, column + 1});
    add({row, column - 1}, {row, column}, {row + 1, column});
  }
}

void CapSquares::AddTriangles(CutMesh& mesh) const {
  for (const auto& [at, shell] : squares_) {
    const std::uint32_t low = PointAt(at), right = PointAt({at.row, at.column + 1}),
                        high = PointAt({at.row + 1, at.column + 1}),
                        left = PointAt({at.row + 1, at.column});
    mesh.triangles.insert(mesh.triangles.end(), {low, right, high, low, high, left});
    mesh.shell_of.insert(mesh.shell_of.end(), 2, shell);
  }
}

}  // namespace partiemc::space
