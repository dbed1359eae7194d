#include "phases/phase_areas.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "base/bits.h"
#include "vertices/measure.h"
#include "walls/tile_point.h"

namespace partiemc {
namespace {

constexpr int kMostSteps = 100;
// The solver stops at this share of the first residual.
constexpr double kTolerance = 1e-6;

struct Areas {
  std::span<const PhaseRings> phases;
  const Interfaces& interfaces;
  const PhaseImages& images;
  PhaseAreaScratch& s;

  std::uint32_t LeftOf(const PhaseArc& arc) const {
    return images.RootOf(images.RegionOf(arc.left - 1u, arc.left_component));
  }
  std::uint32_t RightOf(const PhaseArc& arc) const {
    return images.RootOf(images.RegionOf(arc.right - 1u, arc.right_component));
  }
};

// The area of the part of a ring in the window.
double AreaInWindow(std::span<const std::uint32_t> ring, const SharedPoints& points, Areas& a) {
  a.s.ring.clear();
  for (const std::uint32_t point : ring) {
    a.s.ring.push_back(points.position[point].x);
    a.s.ring.push_back(points.position[point].y);
  }
  return MeasureInWindow(a.s.ring, a.images.window()).area;
}

void SumAreas(const SharedPoints& points, Areas& a) {
  for (std::size_t phase = 0; phase < a.phases.size(); ++phase) {
    const PhaseRings& rings = a.phases[phase];
    for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
      const std::span<const std::uint32_t> of = rings.RingPoints(ring);
      const std::uint32_t region = a.images.RegionOf(phase, rings.topology.component_of_ring[ring]);
      if (a.images.IsCut(region)) {
        a.s.area[a.images.RootOf(region)] += AreaInWindow(of, points, a);
        continue;
      }
      const Point origin = points.position[of[0]];
      double twice = 0;
      for (std::size_t k = 1; k + 1 < of.size(); ++k) {
        const Point& b = points.position[of[k]];
        const Point& c = points.position[of[k + 1]];
        twice += (b.x - origin.x) * (c.y - origin.y) - (c.x - origin.x) * (b.y - origin.y);
      }
      a.s.area[region] += twice / 2;
    }
  }
}

void MeasureArcs(const SharedPoints& points, Areas& a) {
  a.s.length.clear();
  for (const PhaseArc& arc : a.interfaces.arcs) {
    const std::span<const std::uint32_t> inner = a.interfaces.InnerPoints(arc);
    const bool is_cut = a.images.IsCut(a.LeftOf(arc));
    double length = 0;
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
      const Point& p = points.position[from];
      const Point& q = points.position[to];
      if (is_cut) {
        length += LengthInWindow(p, q, a.images.window());
        return;
      }
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

void SumRegions(const RegionInput& input, PhaseImages& images, PhaseAreaScratch& s) {
  const ParticleBins& bins = input.bins;
  const Scale& scale = input.scale;
  s.count.assign(images.RegionCount(), 0);
  s.volume.assign(images.RegionCount(), 0);
  const bool has_copies = images.HasCopies();
  s.region_of.assign(has_copies ? input.labels.size() : 0, kNoComponent);
  const double square = scale.spacing * scale.spacing, per_weight = 1 / scale.weight_per_volume;
  const auto volume_of = [&](std::uint32_t k) {
    if (!bins.size.empty()) return bins.size[k] * bins.size[k] * square;
    return (bins.weight.empty() ? scale.uniform_weight : double{bins.weight[k]}) * per_weight;
  };
  for (std::uint32_t tile = 0; tile < bins.tiles.size(); ++tile) {
    const std::uint32_t first = bins.offsets[tile], last = bins.offsets[tile + 1];
    if (first == last) continue;
    const Point origin = OriginOf(bins.tiles, tile);
    const auto only = OnlyRegion(input.field, input.phases, tile);
    if (only && !has_copies) {
      const std::uint32_t region = images.RegionOf(only->label - 1u, only->component);
      s.count[region] += last - first;
      for (std::uint32_t k = first; k < last; ++k) s.volume[region] += volume_of(k);
      continue;
    }
    for (std::uint32_t k = first; k < last; ++k) {
      const BinnedParticle& particle = bins.particles[k];
      const auto region_in = [&](PhaseLabel label) {
        const PhaseRings& phase = input.phases[label - 1u];
        const std::uint32_t component =
            only && only->label == label
                ? only->component
                : phase.topology.components.ComponentOf(bins.tiles, phase.crossings, tile,
                                                        particle.x, particle.y);
        return component == kNoComponent ? kNoComponent : images.RegionOf(label - 1u, component);
      };
      PhaseLabel label = input.labels[particle.source];
      std::uint32_t region = region_in(label);
      if (region != kNoComponent) {
        const Point at{origin.x + particle.x, origin.y + particle.y};
        if (has_copies && images.DecidesImages(particle.source, at)) {
          s.region_of[particle.source] = region;
        }
        s.count[region] += images.Counts(particle.source, region) ? 1 : 0;
      } else {
        label = input.map.At(Normalise(bins.tiles, tile, static_cast<int>(particle.x + .5F),
                                       static_cast<int>(particle.y + .5F)));
        if (label != kNoPhase) region = region_in(label);
      }
      if (region != kNoComponent && images.Counts(particle.source, region)) {
        s.volume[region] += volume_of(k);
      }
    }
  }
  if (!has_copies) return;
  images.JoinImages(input.originals, bins.tiles, input.phases, s.region_of);
  for (std::uint32_t region = 0; region < images.RegionCount(); ++region) {
    const std::uint32_t root = images.RootOf(region);
    if (root != region) s.volume[root] += std::exchange(s.volume[region], 0);
  }
}

void MatchPhaseAreas(std::span<const PhaseRings> phases, const Interfaces& interfaces,
                     const PhaseImages& images, double limit, PhaseAreaScratch& scratch,
                     SharedPoints& points) {
  Areas a{phases, interfaces, images, scratch};
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
