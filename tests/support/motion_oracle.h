// The noise filter by brute force: sums over all pairs of particles (core/NOISE.md).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "base/vec3.h"
#include "partiemc/parameters.h"

namespace partiemc::support {

/// Particles in up to three coordinates, with spacing 1. Absent coordinates are 0.
struct FilterOracle {
  struct Known {
    Vec3 given, offset;
  };
  using Cell = std::array<std::int64_t, 3>;

  double weight = .5;
  int axes = 2;
  std::optional<PeriodicBox> box = std::nullopt;
  std::map<std::uint64_t, Known> known = {};

  /// Takes a frame; `known` then has its particles.
  void Next(const std::vector<std::uint64_t>& ids, const std::vector<Vec3>& given) {
    struct Mover {
      std::size_t particle;
      Vec3 at, moved;  // In the box.
      Cell cell;
    };
    std::map<std::uint64_t, Known> next;
    for (std::size_t k = 0; k < ids.size(); ++k) next[ids[k]] = {given[k], {}};
    std::vector<Mover> movers;
    std::map<Cell, std::pair<int, Vec3>> sums;
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const auto last = known.find(ids[k]);
      if (last == known.end()) continue;
      const Vec3 moved = Nearest(given[k] - last->second.given);
      if (Dot(moved, moved) > 25) continue;
      const Vec3 at = Wrapped(given[k]);
      const Cell cell = CellOf(at);
      movers.push_back({k, at, moved, cell});
      auto& [count, sum] = sums[cell];
      ++count;
      sum = sum + moved;
    }
    const auto mean_of = [&](const Cell& cell) {
      const auto& [count, sum] = sums.at(cell);
      return (1.0 / count) * sum;
    };
    for (const Mover& mover : movers) {
      std::vector<Mover> near;
      std::vector<double> weights;
      for (const Mover& other : movers) {
        for (const Cell& image : Images()) {
          double share = 1;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t apart =
                other.cell[axis] + image[axis] * Cells(axis) - mover.cell[axis];
            share *= std::max(0.0, 1 - std::abs(static_cast<double>(apart)) / 3);
          }
          const Vec3 unlike = mean_of(other.cell) - mean_of(mover.cell);
          const double likeness = std::max(0.0, 1 - std::pow(Dot(unlike, unlike) / .49, 2));
          if (share * likeness == 0) continue;
          Mover moved = other;
          moved.at = other.at + Vec3{static_cast<double>(image[0]) * Length(0),
                                     static_cast<double>(image[1]) * Length(1),
                                     static_cast<double>(image[2]) * Length(2)};
          near.push_back(moved);
          weights.push_back(share * likeness * likeness);
        }
      }
      const Vec3 motion = Fit(mover.at, near, weights);
      const Vec3 offset = known.at(ids[mover.particle]).offset + motion - mover.moved;
      if (Dot(offset, offset) > 1) continue;
      next.at(ids[mover.particle]).offset = (1 - weight) * offset;
    }
    known = next;
  }

 private:
  double Length(std::size_t axis) const {
    return box && box->axes[axis] ? box->axes[axis]->length : 0;
  }
  double Origin(std::size_t axis) const {
    return box && box->axes[axis] ? box->axes[axis]->origin : 0;
  }
  std::int64_t Cells(std::size_t axis) const { return static_cast<std::int64_t>(Length(axis) / 3); }
  static std::array<double, 3> Array(const Vec3& v) { return {v.x, v.y, v.z}; }

  std::vector<Cell> Images() const {
    std::vector<Cell> images;
    const auto most = [&](std::size_t axis) { return Length(axis) > 0 ? 1 : 0; };
    for (int x = -most(0); x <= most(0); ++x) {
      for (int y = -most(1); y <= most(1); ++y) {
        for (int z = -most(2); z <= most(2); ++z) images.push_back({x, y, z});
      }
    }
    return images;
  }
  Vec3 Nearest(const Vec3& v) const {
    auto values = Array(v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (Length(axis) == 0) continue;
      while (values[axis] > Length(axis) / 2) values[axis] -= Length(axis);
      while (values[axis] < -Length(axis) / 2) values[axis] += Length(axis);
    }
    return {values[0], values[1], values[2]};
  }
  Vec3 Wrapped(const Vec3& v) const {
    auto values = Array(v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (Length(axis) == 0) continue;
      while (values[axis] >= Origin(axis) + Length(axis)) values[axis] -= Length(axis);
      while (values[axis] < Origin(axis)) values[axis] += Length(axis);
    }
    return {values[0], values[1], values[2]};
  }
  Cell CellOf(const Vec3& at) const {
    const auto values = Array(at);
    Cell cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double side = Length(axis) > 0 ? Length(axis) / static_cast<double>(Cells(axis)) : 3;
      cell[axis] = static_cast<std::int64_t>(std::floor((values[axis] - Origin(axis)) / side));
    }
    return cell;
  }

  // The affine map of least squares with a ridge, at a point. By elimination.
  template <typename Mover>
  static Vec3 Fit(const Vec3& at, const std::vector<Mover>& near,
                  const std::vector<double>& weights) {
    double total = 0;
    Vec3 centre, mean;
    for (std::size_t k = 0; k < near.size(); ++k) total += weights[k];
    for (std::size_t k = 0; k < near.size(); ++k) {
      centre = centre + (weights[k] / total) * near[k].at;
      mean = mean + (weights[k] / total) * near[k].moved;
    }
    double matrix[3][6] = {};
    for (int i = 0; i < 3; ++i) matrix[i][i] = .25;
    for (std::size_t k = 0; k < near.size(); ++k) {
      const auto from = Array(near[k].at - centre), moved = Array(near[k].moved - mean);
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          matrix[i][j] += weights[k] / total * from[i] * from[j];
          matrix[i][3 + j] += weights[k] / total * from[i] * moved[j];
        }
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int row = 0; row < 3; ++row) {
        if (row == i) continue;
        const double factor = matrix[row][i] / matrix[i][i];
        for (int column = 0; column < 6; ++column) {
          matrix[row][column] -= factor * matrix[i][column];
        }
      }
    }
    const auto from = Array(at - centre);
    std::array<double, 3> motion = Array(mean);
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t i = 0; i < 3; ++i) {
        motion[j] += from[i] * matrix[i][3 + j] / matrix[i][i];
      }
    }
    return {motion[0], motion[1], motion[2]};
  }
};

}  // namespace partiemc::support
