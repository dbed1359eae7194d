#include "support/grain_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace partiemc::support {
namespace {

struct Grain {
  double x, y, radius;
};

Particles ParticlesOf(const std::vector<Grain>& grains) {
  Particles particles;
  for (const Grain& grain : grains) {
    particles.Add(grain.x, grain.y);
    particles.volumes.push_back(static_cast<float>(4 * grain.radius * grain.radius));
  }
  return particles;
}

// Whether a grain overlaps another one by more than rounding.
bool Overlaps(const std::vector<Grain>& grains, const Grain& grain) {
  return std::ranges::any_of(grains, [&](const Grain& other) {
    const double apart = std::hypot(other.x - grain.x, other.y - grain.y);
    return apart < (1 - 1e-9) * (other.radius + grain.radius);
  });
}

// Calls visit(grain) for the two places at which a grain of this radius touches both grains.
template <typename Visit>
void ForEachPlace(const Grain& a, const Grain& b, double radius, Visit visit) {
  const double dx = b.x - a.x, dy = b.y - a.y, apart = std::hypot(dx, dy);
  const double to_a = a.radius + radius, to_b = b.radius + radius;
  if (apart > to_a + to_b || apart == 0) return;
  const double along = (apart * apart + to_a * to_a - to_b * to_b) / (2 * apart);
  const double square = to_a * to_a - along * along;
  if (square < 0) return;
  const double across = std::sqrt(square);
  for (const double side : {-across, across}) {
    visit(Grain{a.x + (along * dx - side * dy) / apart, a.y + (along * dy + side * dx) / apart,
                radius});
  }
}

// Adds a grain where `cost` is least, at a place where it touches two others and overlaps none.
void AddAtBestPlace(std::vector<Grain>& grains, double radius,
                    const std::function<double(const Grain&)>& cost) {
  Grain best{0, 0, radius};
  double least = 1e300;
  for (std::size_t a = 0; a < grains.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      ForEachPlace(grains[a], grains[b], radius, [&](const Grain& grain) {
        const double own = cost(grain);
        if (own >= least || Overlaps(grains, grain)) return;
        least = own;
        best = grain;
      });
    }
  }
  grains.push_back(best);
}

double DistanceToSegment(double x, double y, const double* a, const double* b) {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  const double square = dx * dx + dy * dy;
  const double at =
      square > 0 ? std::clamp(((x - a[0]) * dx + (y - a[1]) * dy) / square, 0.0, 1.0) : 0;
  return std::hypot(a[0] + at * dx - x, a[1] + at * dy - y);
}

// Calls visit(a, b) for each segment of the rings.
template <typename Visit>
void ForEachSegment(const Rings& rings, Visit visit) {
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const auto points = rings.RingPoints(ring);
    const std::size_t count = points.size() / 2;
    for (std::size_t k = 0; k < count; ++k) {
      visit(points.data() + 2 * k, points.data() + 2 * ((k + 1) % count));
    }
  }
}

}  // namespace

Particles GrainHeap(Random& random, std::size_t count, const DrawDiameter& draw) {
  std::vector<Grain> grains{{0, 0, draw(random) / 2}};
  const double radius = draw(random) / 2, angle = random.Uniform(0, 2 * std::numbers::pi);
  const double apart = grains[0].radius + radius;
  grains.push_back({apart * std::cos(angle), apart * std::sin(angle), radius});
  while (grains.size() < count) {
    AddAtBestPlace(grains, draw(random) / 2,
                   [](const Grain& grain) { return std::hypot(grain.x, grain.y); });
  }
  return ParticlesOf(grains);
}

Particles GrainColumn(Random& random, std::size_t count, const DrawDiameter& draw) {
  constexpr double kWidth = 12;
  std::vector<Grain> grains;
  double x = 0;
  while (x < kWidth) {
    const double radius = draw(random) / 2;
    const double before = grains.empty() ? radius : grains.back().radius;
    // Both touch the floor and each other.
    x += grains.empty() ? 0 : 2 * std::sqrt(radius * before);
    grains.push_back({x, radius, radius});
  }
  while (grains.size() < count) {
    AddAtBestPlace(grains, draw(random) / 2, [&](const Grain& grain) {
      const bool is_in = grain.x > 0 && grain.x < x && grain.y > grain.radius;
      return is_in ? grain.y : 1e300;
    });
  }
  return ParticlesOf(grains);
}

Particles GrainSpray(Random& random, std::size_t count, const DrawDiameter& draw) {
  std::vector<Grain> grains;
  double side = 1;
  while (grains.size() < count) {
    side *= 1.01;
    const double radius = draw(random) / 2;
    const double x = random.Uniform(-side, side), y = random.Uniform(-side, side);
    const bool is_lone = std::ranges::none_of(grains, [&](const Grain& other) {
      const double gap = std::hypot(other.x - x, other.y - y) - other.radius - radius;
      return gap < 2 * std::max(other.radius, radius);
    });
    if (is_lone) grains.push_back({x, y, radius});
  }
  return ParticlesOf(grains);
}

double DiameterOf(const Particles& grains, std::size_t k) {
  return std::sqrt(double{grains.volumes[k]});
}

bool IsInside(const Rings& rings, double x, double y) {
  bool is_inside = false;
  ForEachSegment(rings, [&](const double* a, const double* b) {
    if ((a[1] > y) == (b[1] > y)) return;
    const double at = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
    if (at > x) is_inside = !is_inside;
  });
  return is_inside;
}

GrainFigures MeasureGrains(const Rings& rings, const Particles& grains) {
  GrainFigures figures;
  for (std::size_t k = 0; k < grains.size(); ++k) {
    figures.lost += IsInside(rings, grains.x(k), grains.y(k)) ? 0 : 1;
  }
  ForEachSegment(rings, [&](const double* a, const double* b) {
    const double x = (a[0] + b[0]) / 2, y = (a[1] + b[1]) / 2;
    std::array<double, 2> nearest{1e300, 1e300};  // Distances of the middle from surfaces.
    std::array<double, 2> diameters{};
    for (std::size_t k = 0; k < grains.size(); ++k) {
      const double diameter = DiameterOf(grains, k);
      const double cut = diameter / 2 - DistanceToSegment(grains.x(k), grains.y(k), a, b);
      figures.worst_cut = std::max(figures.worst_cut, cut / diameter);
      const double distance = std::hypot(grains.x(k) - x, grains.y(k) - y) - diameter / 2;
      const std::size_t rank = distance < nearest[0] ? 0 : distance < nearest[1] ? 1 : 2;
      if (rank == 2) continue;
      if (rank == 0) {
        nearest[1] = nearest[0];
        diameters[1] = diameters[0];
      }
      nearest[rank] = distance;
      diameters[rank] = diameter;
    }
    const double size = grains.size() > 1 ? (diameters[0] + diameters[1]) / 2 : diameters[0];
    figures.farthest = std::max(figures.farthest, nearest[0] / size);
  });
  return figures;
}

}  // namespace partiemc::support
