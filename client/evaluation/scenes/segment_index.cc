#include "client/evaluation/scenes/segment_index.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace partiemc::evaluation {
namespace {

constexpr double kMaxCellsPerSegment = 8;

// Whether the segments cross in an inner point of both.
bool Cross(const Point& a, const Point& b, const Point& c, const Point& d) {
  const double c_side = evaluation::Cross(b - a, c - a);
  const double d_side = evaluation::Cross(b - a, d - a);
  const double a_side = evaluation::Cross(d - c, a - c);
  const double b_side = evaluation::Cross(d - c, b - c);
  return c_side * d_side < 0 && a_side * b_side < 0;
}

}  // namespace

SegmentIndex::SegmentIndex(const Outline& outline, double cell) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  low_ = {infinity, infinity};
  high_ = {-infinity, -infinity};
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    const std::uint32_t begin = outline.offsets[k];
    const std::uint32_t end = outline.offsets[k + 1];
    for (std::uint32_t i = begin; i < end; ++i) {
      const std::uint32_t next = i + 1 < end ? i + 1 : begin;
      const Point a = outline.points[i];
      segments_.push_back({a, outline.points[next], next});
      low_ = {std::min(low_.x, a.x), std::min(low_.y, a.y)};
      high_ = {std::max(high_.x, a.x), std::max(high_.y, a.y)};
    }
  }
  if (segments_.empty()) return;
  const double width = high_.x - low_.x;
  const double height = high_.y - low_.y;
  const double budget = kMaxCellsPerSegment * static_cast<double>(segments_.size()) + 64;
  cell_ = std::max({cell, std::sqrt(width * height / budget), width / budget, height / budget});
  columns_ = static_cast<int>(width / cell_) + 1;
  rows_ = static_cast<int>(height / cell_) + 1;
  starts_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  // Counted first, then filled from the end of each cell's range.
  for (const bool fill : {false, true}) {
    for (std::size_t k = segments_.size(); k-- > 0;) {
      const auto& [a, b, next] = segments_[k];
      const auto [left, right] = std::minmax({ColumnOf(a.x), ColumnOf(b.x)});
      const auto [bottom, top] = std::minmax({RowOf(a.y), RowOf(b.y)});
      for (int row = bottom; row <= top; ++row) {
        for (int column = left; column <= right; ++column) {
          std::uint32_t& start = starts_[static_cast<std::size_t>(row) * columns_ + column];
          if (fill) {
            members_[--start] = static_cast<std::uint32_t>(k);
          } else {
            ++start;
          }
        }
      }
    }
    if (fill) break;
    std::uint32_t sum = 0;
    for (std::uint32_t& start : starts_) start = sum += start;
    members_.resize(sum);
  }
}

int SegmentIndex::ColumnOf(double x) const {
  return static_cast<int>(std::clamp((x - low_.x) / cell_, 0.0, columns_ - 1.0));
}

int SegmentIndex::RowOf(double y) const {
  return static_cast<int>(std::clamp((y - low_.y) / cell_, 0.0, rows_ - 1.0));
}

std::span<const std::uint32_t> SegmentIndex::Cell(int column, int row) const {
  const std::size_t cell = static_cast<std::size_t>(row) * columns_ + column;
  return std::span(members_).subspan(starts_[cell], starts_[cell + 1] - starts_[cell]);
}

void SegmentIndex::SearchRow(Point p, int row, int first, int last, Nearest& best,
                             double& square) const {
  for (int column = first; column <= last; ++column) {
    for (const std::uint32_t k : Cell(column, row)) {
      const Point a = segments_[k].a;
      const Point along = segments_[k].b - a;
      const double length = Dot(along, along);
      const double t = length > 0 ? std::clamp(Dot(p - a, along) / length, 0.0, 1.0) : 0.0;
      const Point foot = a + t * along;
      const double candidate = Dot(p - foot, p - foot);
      if (candidate < square) {
        square = candidate;
        best.point = foot;
        best.segment = k;
      }
    }
  }
}

SegmentIndex::Nearest SegmentIndex::Find(Point p) const {
  Nearest best;
  double square = std::numeric_limits<double>::infinity();
  const int column = ColumnOf(p.x);
  const int row = RowOf(p.y);
  // Distance from p to the cell that it is nearest to, along each axis: 0 within the grid.
  const double outside_x = std::max({0.0, low_.x - p.x, p.x - (low_.x + columns_ * cell_)});
  const double outside_y = std::max({0.0, low_.y - p.y, p.y - (low_.y + rows_ * cell_)});
  // Everything in a square ring of cells is at least this far beyond the cells inside of it.
  const double to_side =
      std::max(0.0, std::min({p.x - (low_.x + column * cell_), low_.x + (column + 1) * cell_ - p.x,
                              p.y - (low_.y + row * cell_), low_.y + (row + 1) * cell_ - p.y}));
  const int last_ring = std::max({column, columns_ - 1 - column, row, rows_ - 1 - row});
  for (int ring = 0; ring <= last_ring; ++ring) {
    if (ring > 0) {
      const double reach = to_side + (ring - 1) * cell_;
      const double bound = std::max({reach * reach, outside_x * outside_x + outside_y * outside_y});
      if (square <= bound) break;
    }
    const int left = std::max(0, column - ring);
    const int right = std::min(columns_ - 1, column + ring);
    for (int r = std::max(0, row - ring); r <= std::min(rows_ - 1, row + ring); ++r) {
      if (r == row - ring || r == row + ring) {
        SearchRow(p, r, left, right, best, square);
      } else {
        if (column - ring >= 0) SearchRow(p, r, column - ring, column - ring, best, square);
        if (column + ring < columns_) SearchRow(p, r, column + ring, column + ring, best, square);
      }
    }
  }
  best.distance = std::sqrt(square);
  return best;
}

bool SegmentIndex::Contains(Point p) const {
  if (segments_.empty() || p.x < low_.x || p.x > high_.x || p.y < low_.y || p.y > high_.y) {
    return false;
  }
  // A segment in several cells of the row counts in the cell of its crossing only.
  const int row = RowOf(p.y);
  bool inside = false;
  for (int column = ColumnOf(p.x); column < columns_; ++column) {
    for (const std::uint32_t k : Cell(column, row)) {
      const auto& [a, b, next] = segments_[k];
      if ((a.y > p.y) == (b.y > p.y)) continue;
      // Rounding must not move the crossing into a cell that does not know the segment.
      const double x = std::clamp(a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x), std::min(a.x, b.x),
                                  std::max(a.x, b.x));
      if (x > p.x && ColumnOf(x) == column) inside = !inside;
    }
  }
  return inside;
}

double SegmentIndex::SignedDistance(Point p) const {
  const double distance = Find(p).distance;
  return Contains(p) ? distance : -distance;
}

Point SegmentIndex::OutwardNormal(std::uint32_t segment) const {
  const Point along = segments_[segment].b - segments_[segment].a;
  const double length = Length(along);
  return length > 0 ? Point{along.y / length, -along.x / length} : Point{};
}

double SegmentIndex::Extent() const { return Empty() ? 0 : Length(high_ - low_); }

std::size_t SegmentIndex::CountCrossings() const {
  std::vector<std::uint64_t> pairs;
  for (std::size_t cell = 0; cell + 1 < starts_.size(); ++cell) {
    for (std::uint32_t m = starts_[cell]; m < starts_[cell + 1]; ++m) {
      for (std::uint32_t n = m + 1; n < starts_[cell + 1]; ++n) {
        const std::uint32_t i = std::min(members_[m], members_[n]);
        const std::uint32_t j = std::max(members_[m], members_[n]);
        if (segments_[i].next == j || segments_[j].next == i) continue;
        if (Cross(segments_[i].a, segments_[i].b, segments_[j].a, segments_[j].b)) {
          pairs.push_back(std::uint64_t{i} << 32 | j);
        }
      }
    }
  }
  // A pair meets in every cell that both segments reach.
  std::sort(pairs.begin(), pairs.end());
  return static_cast<std::size_t>(std::unique(pairs.begin(), pairs.end()) - pairs.begin());
}

}  // namespace partiemc::evaluation
