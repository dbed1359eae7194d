#include "phases/phase_field.h"

#include <algorithm>
#include <cmath>

#include "base/bits.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

// g is the mean of two estimates of the height above the boundary. Per spacing, the density changes
// by 4.66 / (2 beta) and the distance to the mean position by 1.4.
constexpr double kDensitySlope = 4.66, kDistanceSlope = 2.8;

// g of a phase without particles.
constexpr double kAbsent = -1e30;

}  // namespace

void PhaseField::Build(const ParticleBins& bins, const Scale& scale,
                       std::span<const PhaseLabel> labels) {
  tiles_ = &bins.tiles;
  kernel_radius_ = scale.kernel_radius;
  // Rounding may make the reach of a kernel larger than a tile.
  reach_ = std::min<double>(scale.reach, kTileSize);
  spacing_ = scale.spacing;
  beta_ = scale.kernel_radius / scale.spacing;
  const std::size_t count = bins.tiles.size();
  own_.assign(count, 0);
  ParallelFor(count, [&](std::size_t tile) {
    for (std::uint32_t k = bins.offsets[tile]; k < bins.offsets[tile + 1]; ++k) {
      own_[tile] |= 1u << labels[bins.particles[k].source];
    }
  });
  around_.assign(count, 0);
  slot_.assign(count, kNoTile);
  for (std::size_t tile = 0; tile < count; ++tile) {
    for (const std::uint32_t near : bins.tiles.neighbours(tile)) {
      if (near != kNoTile) around_[tile] |= own_[near];
    }
    if (!HasSeveral(around_[tile])) continue;
    for (const std::uint32_t near : bins.tiles.neighbours(tile)) {
      if (near != kNoTile) slot_[near] = 0;
    }
  }
  chosen_.clear();
  for (std::uint32_t tile = 0; tile < count; ++tile) {
    if (slot_[tile] == kNoTile) continue;
    slot_[tile] = static_cast<std::uint32_t>(chosen_.size());
    chosen_.push_back(tile);
  }
  offsets_.resize(chosen_.size());
  std::uint32_t total = 0;
  for (std::size_t slot = 0; slot < chosen_.size(); ++slot) {
    offsets_[slot][0] = total;
    total += bins.CountOf(chosen_[slot]);
  }
  particles_.resize(total);
  ParallelFor(chosen_.size(), [&](std::size_t slot) {
    const std::uint32_t tile = chosen_[slot];
    std::array<std::uint32_t, kTileNodes + 1>& offsets = offsets_[slot];
    std::fill(offsets.begin() + 1, offsets.end(), 0);
    const auto cell_of = [](const BinnedParticle& particle) {
      return static_cast<int>(particle.y) * kTileSize + static_cast<int>(particle.x);
    };
    const std::uint32_t begin = bins.offsets[tile], end = bins.offsets[tile + 1];
    for (std::uint32_t k = begin; k < end; ++k) ++offsets[cell_of(bins.particles[k]) + 1];
    for (int cell = 0; cell < kTileNodes; ++cell) offsets[cell + 1] += offsets[cell];
    std::array<std::uint32_t, kTileNodes> next;
    std::copy(offsets.begin(), offsets.end() - 1, next.begin());
    for (std::uint32_t k = begin; k < end; ++k) {
      const BinnedParticle& particle = bins.particles[k];
      const bool has_sizes = !bins.size.empty();
      // With own sizes, f does not contain volumes.
      const bool has_volumes = !bins.weight.empty() && !has_sizes;
      const double weight = has_volumes ? double{bins.weight[k]} : scale.uniform_weight;
      particles_[next[cell_of(particle)]++] = {particle.x, particle.y, static_cast<float>(weight),
                                               has_sizes ? bins.size[k] : 1.0F,
                                               labels[particle.source]};
    }
  });
}

void PhaseField::PhasesAroundCells(std::uint32_t tile,
                                   std::array<std::uint32_t, kTileNodes>& phases) const {
  const int reach = static_cast<int>(std::ceil(reach_));
  const int side = kTileSize + 2 * reach;
  // The phases of the cells in reach, row by row, then the union of each row's windows.
  std::array<std::uint32_t, 3 * kTileSize> row;
  std::array<std::array<std::uint32_t, kTileSize>, 3 * kTileSize> windows;
  const auto or_windows = [&](const std::uint32_t* from, std::uint32_t* to, std::ptrdiff_t stride) {
    for (int k = 0; k < kTileSize; ++k) {
      std::uint32_t bits = 0;
      for (int step = 0; step <= 2 * reach; ++step) bits |= from[(k + step) * stride];
      to[k * stride] = bits;
    }
  };
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const TilePlace place = Normalise(*tiles_, tile, i - reach, j - reach);
      row[i] = 0;
      if (place.tile == kNoTile) continue;
      const auto& offsets = offsets_[slot_[place.tile]];
      const int cell = place.j * kTileSize + place.i;
      for (std::uint32_t k = offsets[cell]; k < offsets[cell + 1]; ++k) {
        row[i] |= 1u << particles_[k].label;
      }
    }
    or_windows(row.data(), windows[j].data(), 1);
  }
  for (int j = 0; j < kTileSize; ++j) {
    for (int i = 0; i < kTileSize; ++i) {
      std::uint32_t bits = 0;
      for (int step = 0; step <= 2 * reach; ++step) bits |= windows[j + step][i];
      phases[j * kTileSize + i] = bits;
    }
  }
}

// Calls visit(particle, dx, dy, t) for each particle whose kernel reaches the point. (dx, dy) leads
// from the point to the particle, in cells; t = 1 - squared distance / squared kernel radius.
template <typename Visit>
void PhaseField::ForEachNear(std::uint32_t tile, double x, double y, Visit visit) const {
  // A point on a side of its tile may reach a cell of the tile after the next, which no kernel
  // enters.
  static constexpr int kFirst = -kTileSize, kLast = 2 * kTileSize - 1;
  const auto cell_of = [](double at) {
    return std::clamp(static_cast<int>(std::floor(at)), kFirst, kLast);
  };
  const int left = cell_of(x - reach_), right = cell_of(x + reach_);
  const int low = cell_of(y - reach_), high = cell_of(y + reach_);
  for (int j = low; j <= high; ++j) {
    for (int i = left; i <= right;) {
      // The cells of this row in one tile are consecutive.
      const TilePlace place = Normalise(*tiles_, tile, i, j);
      const int cells = std::min(right - i + 1, kTileSize - place.i);
      if (place.tile != kNoTile && slot_[place.tile] != kNoTile) {
        const auto& offsets = offsets_[slot_[place.tile]];
        const int first = place.j * kTileSize + place.i;
        const double to_x = i - place.i - x, to_y = j - place.j - y;
        for (std::uint32_t k = offsets[first]; k < offsets[first + cells]; ++k) {
          const Particle& particle = particles_[k];
          const double dx = particle.x + to_x, dy = particle.y + to_y;
          const double radius = kernel_radius_ * particle.size;
          const double t = 1 - (dx * dx + dy * dy) / (radius * radius);
          if (t > 0) visit(particle, dx, dy, t);
        }
      }
      i += cells;
    }
  }
}

void PhaseField::Add(const Particle& particle, double dx, double dy, double t,
                     PhaseSums& sums) const {
  const double k = t * t * t;
  const double scale = k / (particle.size * spacing_);
  sums.density += k * particle.weight;
  sums.sum += k;
  sums.x += scale * dx;
  sums.y += scale * dy;
}

double PhaseField::ValueOf(const PhaseSums& sums) const {
  if (sums.sum == 0) return kAbsent;
  const double distance = std::sqrt(sums.x * sums.x + sums.y * sums.y) / sums.sum;
  return sums.density * beta_ / kDensitySlope - distance / kDistanceSlope;
}

PhaseLabel PhaseField::LargestAt(std::uint32_t tile, double x, double y) const {
  std::array<PhaseSums, kMostPhases> sums{};
  ForEachNear(tile, x, y, [&](const Particle& particle, double dx, double dy, double t) {
    Add(particle, dx, dy, t, sums[particle.label]);
  });
  PhaseLabel largest = kNoPhase;
  double value = kAbsent;
  for (std::size_t label = 1; label < sums.size(); ++label) {
    const double other = ValueOf(sums[label]);
    if (other <= value) continue;
    value = other;
    largest = static_cast<PhaseLabel>(label);
  }
  return largest;
}

double PhaseField::Difference(std::uint32_t tile, double x, double y, PhaseLabel a,
                              PhaseLabel b) const {
  PhaseSums of_a, of_b;
  ForEachNear(tile, x, y, [&](const Particle& particle, double dx, double dy, double t) {
    if (particle.label != a && particle.label != b) return;
    Add(particle, dx, dy, t, particle.label == a ? of_a : of_b);
  });
  return ValueOf(of_a) - ValueOf(of_b);
}

PhaseDifference PhaseField::DifferenceAt(std::uint32_t tile, double x, double y, PhaseLabel a,
                                         PhaseLabel b) const {
  struct Sums : PhaseSums {
    // Gradients: of the density, of the sum, and of the sums of x and y.
    double fx = 0, fy = 0, sx = 0, sy = 0, xx = 0, xy = 0, yx = 0, yy = 0;
  };
  Sums of_a, of_b;
  ForEachNear(tile, x, y, [&](const Particle& particle, double dx, double dy, double t) {
    if (particle.label != a && particle.label != b) return;
    Sums& of = particle.label == a ? of_a : of_b;
    const double radius = kernel_radius_ * particle.size;
    const double per_size = 1 / (particle.size * spacing_);
    const double k = t * t * t;
    // The kernel grows towards the particle.
    const double slope = 6 * t * t / (radius * radius);
    const double kx = slope * dx, ky = slope * dy;
    of.density += k * particle.weight;
    of.fx += kx * particle.weight;
    of.fy += ky * particle.weight;
    of.sum += k;
    of.sx += kx;
    of.sy += ky;
    of.x += k * dx * per_size;
    of.y += k * dy * per_size;
    of.xx += (kx * dx - k) * per_size;
    of.xy += ky * dx * per_size;
    of.yx += kx * dy * per_size;
    of.yy += (ky * dy - k) * per_size;
  });
  const auto gradient_of = [&](const Sums& of) {
    PhaseDifference g{ValueOf(of), 0, 0};
    if (of.sum == 0) return g;
    g.gradient_x = of.fx * beta_ / kDensitySlope;
    g.gradient_y = of.fy * beta_ / kDensitySlope;
    const double mx = of.x / of.sum, my = of.y / of.sum;
    const double distance = std::sqrt(mx * mx + my * my);
    if (distance < 1e-9) return g;
    const auto along = [&](double x_by, double y_by, double sum_by) {
      return (mx * (x_by - mx * sum_by) + my * (y_by - my * sum_by)) / (of.sum * distance);
    };
    g.gradient_x -= along(of.xx, of.yx, of.sx) / kDistanceSlope;
    g.gradient_y -= along(of.xy, of.yy, of.sy) / kDistanceSlope;
    return g;
  };
  const PhaseDifference ga = gradient_of(of_a), gb = gradient_of(of_b);
  return {ga.value - gb.value, ga.gradient_x - gb.gradient_x, ga.gradient_y - gb.gradient_y};
}

}  // namespace partiemc
