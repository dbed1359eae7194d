#include "region_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "base/predicates.h"

namespace partiemc::support {

std::uint32_t Region::AddPoint(const Point& point) {
  points.insert(points.end(), {point.x, point.y});
  return static_cast<std::uint32_t>(points.size() / 2 - 1);
}

void Region::AddLoop(const std::vector<Point>& loop) {
  for (const Point& point : loop) loop_points.push_back(AddPoint(point));
  loop_offsets.push_back(static_cast<std::uint32_t>(loop_points.size()));
}

void Region::AddLoop(const std::vector<std::uint32_t>& indices) {
  loop_points.insert(loop_points.end(), indices.begin(), indices.end());
  loop_offsets.push_back(static_cast<std::uint32_t>(loop_points.size()));
}

std::vector<Point> Region::Loop(std::size_t loop) const {
  std::vector<Point> result;
  for (std::uint32_t i = loop_offsets[loop]; i < loop_offsets[loop + 1]; ++i) {
    result.push_back(PointAt(loop_points[i]));
  }
  return result;
}

Region Region::Transformed(double scale, double shift) const {
  Region result = *this;
  for (double& coordinate : result.points) coordinate = coordinate * scale + shift;
  return result;
}

Region RegionOf(const std::vector<std::vector<Point>>& loops) {
  Region region;
  for (const std::vector<Point>& loop : loops) region.AddLoop(loop);
  return region;
}

double DoubleArea(const std::vector<Point>& loop) {
  double sum = 0;
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    sum += (loop[i].x - loop[0].x) * (loop[i + 1].y - loop[0].y) -
           (loop[i].y - loop[0].y) * (loop[i + 1].x - loop[0].x);
  }
  return sum;
}

double DoubleArea(const Region& region) {
  double sum = 0;
  for (std::size_t loop = 0; loop < region.LoopCount(); ++loop)
    sum += DoubleArea(region.Loop(loop));
  return sum;
}

double Uniform(RandomEngine& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

std::vector<Point> Rectangle(double left, double bottom, double right, double top) {
  return {{left, bottom}, {right, bottom}, {right, top}, {left, top}};
}

std::vector<Point> Reversed(std::vector<Point> loop) {
  std::reverse(loop.begin(), loop.end());
  return loop;
}

std::vector<Point> RandomStar(RandomEngine& random, std::size_t count) {
  std::vector<Point> loop;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    const double radius = Uniform(random, 1, 10);
    loop.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return loop;
}

std::vector<Point> Spiral(std::size_t points_per_side, double turns) {
  std::vector<Point> inner, outer;
  for (std::size_t i = 0; i < points_per_side; ++i) {
    const double turn = turns * static_cast<double>(i) / static_cast<double>(points_per_side);
    const double angle = 2 * std::numbers::pi * turn;
    inner.push_back({(1 + turn) * std::cos(angle), (1 + turn) * std::sin(angle)});
    outer.push_back({(1.5 + turn) * std::cos(angle), (1.5 + turn) * std::sin(angle)});
  }
  std::reverse(inner.begin(), inner.end());
  outer.insert(outer.end(), inner.begin(), inner.end());
  return outer;
}

std::vector<Point> Comb(RandomEngine& random, std::size_t teeth) {
  std::vector<Point> loop{{0, 0}, {2 * static_cast<double>(teeth), 0}};
  for (std::size_t tooth = teeth; tooth-- > 0;) {
    const double x = 2 * static_cast<double>(tooth);
    const double length = Uniform(random, 2, 10);
    if (tooth + 1 < teeth) loop.push_back({x + 2, Uniform(random, 0.5, 1.5)});
    loop.push_back({x + 1.5, length});
    loop.push_back({x + 0.5, length});
  }
  loop.push_back({0, 1});
  return loop;
}

std::vector<Point> HangingComb(RandomEngine& random, std::size_t teeth) {
  std::vector<Point> loop = Comb(random, teeth);
  for (Point& point : loop) point = {-point.x, -point.y};
  return loop;
}

namespace {

// A crossed lattice edge: from node (x, y) to the right, or upward.
using LatticeEdge = std::pair<std::size_t, bool>;

class FieldContours {
 public:
  FieldContours(std::vector<double> values, std::size_t size)
      : values_(std::move(values)), size_(size) {}

  Region Trace() {
    for (std::size_t y = 0; y + 1 < size_; ++y) {
      for (std::size_t x = 0; x + 1 < size_; ++x) AddCell(x + y * size_);
    }
    Region region;
    while (!next_.empty()) {
      std::vector<Point> loop;
      for (auto found = next_.begin(); found != next_.end();) {
        loop.push_back(Crossing(found->first));
        const LatticeEdge next = found->second;
        next_.erase(found);
        found = next_.find(next);
      }
      region.AddLoop(loop);
    }
    return region;
  }

 private:
  // Corners 0..3 of a cell counter-clockwise from its lower left one, and side k from corner k to
  // corner k + 1. A contour has the inside on its left. It enters a cell through a side from an
  // inside to an outside corner and leaves through a side from an outside to an inside corner.
  void AddCell(std::size_t node) {
    const std::array<std::size_t, 4> nodes{node, node + 1, node + 1 + size_, node + size_};
    const std::array<LatticeEdge, 4> sides{LatticeEdge{node, false}, LatticeEdge{node + 1, true},
                                           LatticeEdge{node + size_, false},
                                           LatticeEdge{node, true}};
    const auto inside = [&](std::size_t corner) { return values_[nodes[corner % 4]] < 0; };
    const double mean =
        values_[nodes[0]] + values_[nodes[1]] + values_[nodes[2]] + values_[nodes[3]];
    for (std::size_t entry = 0; entry < 4; ++entry) {
      if (!inside(entry) || inside(entry + 1)) continue;
      // Leaves through the nearest side from outside to inside. Searching counter-clockwise
      // separates the outside corners, searching clockwise the inside ones.
      const std::size_t step = mean < 0 ? 1 : 3;
      std::size_t exit = (entry + step) % 4;
      while (inside(exit) || !inside(exit + 1)) exit = (exit + step) % 4;
      next_[sides[entry]] = sides[exit];
    }
  }

  Point Crossing(const LatticeEdge& edge) const {
    const std::size_t other = edge.first + (edge.second ? size_ : 1);
    const double a = values_[edge.first];
    const double t = a / (a - values_[other]);
    const auto x = static_cast<double>(edge.first % size_);
    const auto y = static_cast<double>(edge.first / size_);
    return edge.second ? Point{x, y + t} : Point{x + t, y};
  }

  std::vector<double> values_;
  std::size_t size_;
  std::map<LatticeEdge, LatticeEdge> next_;
};

}  // namespace

Region RandomContours(RandomEngine& random, std::size_t size) {
  struct Wave {
    double x, y, phase;
  };
  std::vector<Wave> waves(8);
  for (Wave& wave : waves) {
    wave = {Uniform(random, -0.7, 0.7), Uniform(random, -0.7, 0.7), Uniform(random, 0, 6.3)};
  }
  std::vector<double> values(size * size, 1.0);
  for (std::size_t y = 1; y + 1 < size; ++y) {
    for (std::size_t x = 1; x + 1 < size; ++x) {
      double value = -0.3;
      for (const Wave& wave : waves) {
        value += std::sin(wave.x * static_cast<double>(x) + wave.y * static_cast<double>(y) +
                          wave.phase);
      }
      values[x + y * size] = value;
    }
  }
  return FieldContours(std::move(values), size).Trace();
}

bool Cells::At(std::ptrdiff_t x, std::ptrdiff_t y) const {
  if (x < 0 || y < 0) return false;
  const auto column = static_cast<std::size_t>(x);
  const auto row = static_cast<std::size_t>(y);
  return column < width && row < height && inside[column + row * width] != 0;
}

Cells RandomCells(RandomEngine& random, std::size_t width, std::size_t height, double density) {
  Cells cells{width, height, std::vector<char>(width * height)};
  for (char& inside : cells.inside) inside = Uniform(random, 0, 1) < density ? 1 : 0;
  return cells;
}

Region Staircases(const Cells& cells, RandomEngine& random, bool corners_only) {
  using Node = std::pair<std::ptrdiff_t, std::ptrdiff_t>;
  std::multimap<Node, Node> sides;
  const auto width = static_cast<std::ptrdiff_t>(cells.width);
  const auto height = static_cast<std::ptrdiff_t>(cells.height);
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    for (std::ptrdiff_t x = 0; x < width; ++x) {
      if (!cells.At(x, y)) continue;
      if (!cells.At(x, y - 1)) sides.insert({{x, y}, {x + 1, y}});
      if (!cells.At(x + 1, y)) sides.insert({{x + 1, y}, {x + 1, y + 1}});
      if (!cells.At(x, y + 1)) sides.insert({{x + 1, y + 1}, {x, y + 1}});
      if (!cells.At(x - 1, y)) sides.insert({{x, y + 1}, {x, y}});
    }
  }
  Region region;
  std::map<Node, std::uint32_t> index_of;
  while (!sides.empty()) {
    std::vector<Node> nodes;
    for (auto side = sides.begin(); side != sides.end();) {
      nodes.push_back(side->first);
      const Node next = side->second;
      sides.erase(side);
      side = sides.find(next);
      if (sides.count(next) == 2 && random() % 2 == 0) ++side;
    }
    std::vector<std::uint32_t> loop;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Node& before = nodes[(i + nodes.size() - 1) % nodes.size()];
      const Node& after = nodes[(i + 1) % nodes.size()];
      const bool is_straight = before.first == after.first || before.second == after.second;
      if (corners_only && is_straight) continue;
      const auto [found, is_new] = index_of.try_emplace(nodes[i], 0u);
      if (is_new) {
        found->second = region.AddPoint(
            {static_cast<double>(nodes[i].first), static_cast<double>(nodes[i].second)});
      }
      loop.push_back(found->second);
    }
    region.AddLoop(loop);
  }
  return region;
}

Region RandomBand(RandomEngine& random, std::size_t size) {
  Region band = RandomContours(random, size);
  Cells cells{size, size, std::vector<char>(size * size)};
  std::vector<char> touched(size * size);
  for (std::size_t k = 0; k < band.LoopCount(); ++k) {
    const std::vector<Point> loop = band.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point& a = loop[i];
      const Point& b = loop[(i + 1) % loop.size()];
      // Both ends lie on the rim of the same cell.
      const double x = (a.x + b.x) / 2, y = (a.y + b.y) / 2;
      touched[static_cast<std::size_t>(x) + static_cast<std::size_t>(y) * size] = 1;
    }
  }
  for (std::size_t y = 0; y < size; ++y) {
    bool inside = false;
    for (std::size_t x = 0; x < size; ++x) {
      // A ray at the height of the cells' centres.
      const double height = static_cast<double>(y) + 0.5;
      std::size_t crossings = 0;
      for (std::size_t k = 0; k < band.LoopCount(); ++k) {
        const std::vector<Point> loop = band.Loop(k);
        for (std::size_t i = 0; i < loop.size(); ++i) {
          Point a = loop[i], b = loop[(i + 1) % loop.size()];
          if ((a.y < height) == (b.y < height)) continue;
          if (a.y > b.y) std::swap(a, b);
          crossings += Orientation(a, b, {static_cast<double>(x) + 0.5, height}) < 0 ? 1 : 0;
        }
      }
      inside = crossings % 2 == 1;
      cells.inside[x + y * size] = inside && touched[x + y * size] == 0 ? 1 : 0;
    }
  }
  const Region staircases = Staircases(cells, random, random() % 2 == 0);
  const auto first = static_cast<std::uint32_t>(band.points.size() / 2);
  band.points.insert(band.points.end(), staircases.points.begin(), staircases.points.end());
  for (std::size_t k = 0; k < staircases.LoopCount(); ++k) {
    std::vector<std::uint32_t> loop;
    for (std::uint32_t i = staircases.loop_offsets[k + 1]; i-- > staircases.loop_offsets[k];) {
      loop.push_back(first + staircases.loop_points[i]);
    }
    band.AddLoop(loop);
  }
  return band;
}

Region RandomGarbage(RandomEngine& random, std::size_t lattice_size, std::size_t max_loops,
                     std::size_t max_points) {
  Region region;
  for (std::size_t i = 0; i < lattice_size * lattice_size; ++i) {
    region.AddPoint({static_cast<double>(i % lattice_size), static_cast<double>(i / lattice_size)});
  }
  for (std::size_t loops = 1 + random() % max_loops; loops > 0; --loops) {
    std::vector<std::uint32_t> loop;
    for (std::size_t points = 3 + random() % (max_points - 2); points > 0; --points) {
      loop.push_back(static_cast<std::uint32_t>(random() % (lattice_size * lattice_size)));
    }
    region.AddLoop(loop);
  }
  return region;
}

}  // namespace partiemc::support
