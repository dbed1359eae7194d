#include "phases/phase_areas.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/bits.h"

namespace partiemc {
namespace {

constexpr int kMostSteps = 100;
// The solver stops at this share of the first residual.
constexpr double kTolerance = 1e-6;

struct Areas {
  std::span<const PhaseRings> phases;
  const Interfaces& interfaces;
  PhaseAreaScratch& s;

  std::uint32_t LeftOf(const PhaseArc& arc) const {
    return s.first_region[arc.left - 1u] + arc.left_component;
  }
  std::uint32_t RightOf(const PhaseArc& arc) const {
    return s.first_region[arc.right - 1u] + arc.right_component;
  }
};

void SumAreas(const SharedPoints& points, Areas& a) {
  for (std::size_t phase = 0; phase < a.phases.size(); ++phase) {
    const PhaseRings& rings = a.phases[phase];
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const std::span<const std::uint32_t> of = rings.RingPoints(ring);
      const Point origin = points.position[of[0]];
      double twice = 0;
      for (std::size_t k = 1; k + 1 < of.size(); ++k) {
        const Point& b = points.position[of[k]];
        const Point& c = points.position[of[k + 1]];
        twice += (b.x - origin.x) * (c.y - origin.y) - (c.x - origin.x) * (b.y - origin.y);
      }
      a.s.area[a.s.first_region[phase] + rings.topology.component_of_ring[ring]] += twice / 2;
    }
  }
}

void MeasureArcs(const SharedPoints& points, Areas& a) {
  a.s.length.clear();
  for (const PhaseArc& arc : a.interfaces.arcs) {
    const std::span<const std::uint32_t> inner = a.interfaces.InnerPoints(arc);
    double length = 0;
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
      const Point& p = points.position[from];
      const Point& q = points.position[to];
      length += std::sqrt((q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y));
    };
    for (std::size_t k = 0; k + 1 < inner.size(); ++k) add(inner[k], inner[k + 1]);
    if (!inner.empty()) {
      if (arc.IsClosed()) {
        add(inner.back(), inner.front());
      } else {
        add(arc.start, inner.front());
        add(inner.back(), arc.end);
      }
    }
    a.s.length.push_back(length);
  }
}

// Sets `wanted` to volume less area, corrected so that its sum over the regions that interfaces
// join is 0. Regions of one body are found by their lowest number.
void SetWanted(Areas& a) {
  const std::size_t count = a.s.volume.size();
  std::vector<std::uint32_t>& body = a.s.body;
  body.resize(count);
  std::iota(body.begin(), body.end(), 0u);
  const auto root = [&](std::uint32_t region) { return RootOf(body, region); };
  for (const PhaseArc& arc : a.interfaces.arcs) {
    const std::uint32_t x = root(a.LeftOf(arc)), y = root(a.RightOf(arc));
    body[std::max(x, y)] = std::min(x, y);
  }
  std::vector<double>& missing = a.s.missing;
  std::vector<double>& volume = a.s.body_volume;
  missing.assign(count, 0);
  volume.assign(count, 0);
  for (std::uint32_t region = 0; region < count; ++region) {
    missing[root(region)] += a.s.volume[region] - a.s.area[region];
    volume[root(region)] += a.s.volume[region];
  }
  a.s.wanted.resize(count);
  for (std::uint32_t region = 0; region < count; ++region) {
    const std::uint32_t of = root(region);
    const double share = volume[of] > 0 ? a.s.volume[region] / volume[of] : 0;
    a.s.wanted[region] = a.s.volume[region] - a.s.area[region] - share * missing[of];
  }
}

// Sets the values of the lowest region of each body to 0.
void Ground(const Areas& a, std::span<double> values) {
  for (std::uint32_t region = 0; region < values.size(); ++region) {
    if (a.s.body[region] == region) values[region] = 0;
  }
}

// product = the matrix of the heights times `vector`.
void Multiply(const Areas& a, std::span<const double> vector, std::span<double> product) {
  std::ranges::fill(product, 0);
  for (std::size_t k = 0; k < a.interfaces.arcs.size(); ++k) {
    const PhaseArc& arc = a.interfaces.arcs[k];
    const double flow = a.s.length[k] * (vector[a.LeftOf(arc)] - vector[a.RightOf(arc)]);
    product[a.LeftOf(arc)] += flow;
    product[a.RightOf(arc)] -= flow;
  }
  Ground(a, product);
}

double Dot(std::span<const double> a, std::span<const double> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// Only differences of heights matter, so the lowest region of each body has the height 0. Without
// it, the matrix would be singular, and rounding would leave the solver without a solution.
void SolveHeights(Areas& a) {
  PhaseAreaScratch& s = a.s;
  const std::size_t count = s.wanted.size();
  s.offset.assign(count, 0);
  s.product.assign(count, 0);
  s.residual = s.wanted;
  Ground(a, s.residual);
  s.direction = s.residual;
  double square = Dot(s.residual, s.residual);
  const double enough = square * kTolerance * kTolerance;
  for (int step = 0; step < kMostSteps && square > enough; ++step) {
    Multiply(a, s.direction, s.product);
    const double slope = Dot(s.direction, s.product);
    if (!(slope > 0)) return;
    const double along = square / slope;
    for (std::size_t k = 0; k < count; ++k) {
      s.offset[k] += along * s.direction[k];
      s.residual[k] -= along * s.product[k];
    }
    const double next = Dot(s.residual, s.residual);
    for (std::size_t k = 0; k < count; ++k) {
      s.direction[k] = s.residual[k] + next / square * s.direction[k];
    }
    square = next;
  }
}

struct RegionOfTile {
  PhaseLabel label;
  std::uint32_t component;
};

// The region of all particles of a tile, if they have one phase and all nodes of the tile are in
// it. Absent if particles may be in several regions.
std::optional<RegionOfTile> OnlyRegion(const PhaseField& field, std::span<const PhaseRings> phases,
                                       std::uint32_t tile) {
  const std::uint32_t bits = field.PhasesIn(tile);
  if ((bits & (bits - 1)) != 0) return std::nullopt;
  const auto label = static_cast<PhaseLabel>(std::countr_zero(bits));
  const PhaseRings& phase = phases[label - 1u];
  if (!IsFull(phase.crossings.tiles[tile].inside)) return std::nullopt;
  return RegionOfTile{label, phase.topology.components.At(phase.crossings, {tile, 0, 0})};
}

}  // namespace

void SumRegions(const ParticleBins& bins, const Scale& scale, const PhaseField& field,
                std::span<const PhaseLabel> labels, const PhaseMap& map,
                std::span<const PhaseRings> phases, PhaseAreaScratch& s) {
  s.first_region.clear();
  std::uint32_t count = 0;
  for (const PhaseRings& phase : phases) {
    s.first_region.push_back(count);
    count += phase.topology.components.size();
  }
  s.count.assign(count, 0);
  s.volume.assign(count, 0);
  const double square = scale.spacing * scale.spacing, per_weight = 1 / scale.weight_per_volume;
  const auto volume_of = [&](std::uint32_t k) {
    if (!bins.size.empty()) return bins.size[k] * bins.size[k] * square;
    return (bins.weight.empty() ? scale.uniform_weight : double{bins.weight[k]}) * per_weight;
  };
  const auto region_of = [&](PhaseLabel label, std::uint32_t component) {
    return s.first_region[label - 1u] + component;
  };
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    const std::uint32_t first = bins.offsets[tile], last = bins.offsets[tile + 1];
    if (first == last) continue;
    if (const auto only = OnlyRegion(field, phases, tile)) {
      const std::uint32_t region = region_of(only->label, only->component);
      s.count[region] += last - first;
      for (std::uint32_t k = first; k < last; ++k) s.volume[region] += volume_of(k);
      continue;
    }
    for (std::uint32_t k = first; k < last; ++k) {
      const BinnedParticle& particle = bins.particles[k];
      const auto component_in = [&](PhaseLabel label) {
        const PhaseRings& phase = phases[label - 1u];
        return phase.topology.components.ComponentOf(bins.tiles, phase.crossings, tile, particle.x,
                                                     particle.y);
      };
      PhaseLabel label = labels[particle.source];
      std::uint32_t component = component_in(label);
      if (component != kNoComponent) {
        ++s.count[region_of(label, component)];
      } else {
        label = map.At(Normalise(bins.tiles, tile, static_cast<int>(particle.x + .5F),
                                 static_cast<int>(particle.y + .5F)));
        if (label != kNoPhase) component = component_in(label);
      }
      if (component != kNoComponent) s.volume[region_of(label, component)] += volume_of(k);
    }
  }
}

void MatchPhaseAreas(std::span<const PhaseRings> phases, const Interfaces& interfaces, double limit,
                     PhaseAreaScratch& scratch, SharedPoints& points) {
  Areas a{phases, interfaces, scratch};
  scratch.area.assign(scratch.volume.size(), 0);
  SumAreas(points, a);
  MeasureArcs(points, a);
  SetWanted(a);
  SolveHeights(a);
  for (const PhaseArc& arc : interfaces.arcs) {
    const double offset =
        std::clamp(scratch.offset[a.LeftOf(arc)] - scratch.offset[a.RightOf(arc)], -limit, limit);
    for (const std::uint32_t point : interfaces.InnerPoints(arc)) {
      points.position[point].x += offset * points.normal[point].x;
      points.position[point].y += offset * points.normal[point].y;
    }
  }
}

}  // namespace partiemc
