#include "support/sized_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace partiemc::support {
namespace {

// Steps of the relaxation, and steps between searches of neighbours.
constexpr int kSteps = 300, kStepsOfSearch = 10;
// Particles repel each other up to this many mean sizes.
constexpr double kRange = 1.6;

struct Vec {
  double x = 0, y = 0;
};

struct Packing {
  std::vector<Vec> at;
  std::vector<double> size;
  std::vector<std::vector<std::size_t>> near;

  void FindNear() {
    near.assign(at.size(), {});
    for (std::size_t a = 0; a < at.size(); ++a) {
      for (std::size_t b = a + 1; b < at.size(); ++b) {
        const double reach = 1.25 * kRange * (size[a] + size[b]) / 2;
        const double dx = at[a].x - at[b].x, dy = at[a].y - at[b].y;
        if (dx * dx + dy * dy < reach * reach) near[a].push_back(b);
      }
    }
  }
};

// The push of a particle at a distance of `apart` mean sizes; 0 beyond the range.
double PushAt(double apart) {
  const double within = 1 - apart / kRange;
  return within > 0 ? within * within : 0;
}

Vec GradientOf(const Body& body, const Vec& at) {
  constexpr double kStep = 1e-4;
  const double x = body.distance(at.x + kStep, at.y) - body.distance(at.x - kStep, at.y);
  const double y = body.distance(at.x, at.y + kStep) - body.distance(at.x, at.y - kStep);
  const double length = std::hypot(x, y);
  return length > 0 ? Vec{x / length, y / length} : Vec{1, 0};
}

// Moves every particle by the pushes of its neighbours and of its mirror image.
void Relax(const Body& body, double step, Packing& packing) {
  std::vector<Vec> push(packing.at.size());
  for (std::size_t a = 0; a < packing.at.size(); ++a) {
    for (const std::size_t b : packing.near[a]) {
      const Vec to{packing.at[a].x - packing.at[b].x, packing.at[a].y - packing.at[b].y};
      const double distance = std::max(std::hypot(to.x, to.y), 1e-9);
      const double force = PushAt(2 * distance / (packing.size[a] + packing.size[b])) / distance;
      push[a].x += packing.size[b] * force * to.x;
      push[a].y += packing.size[b] * force * to.y;
      push[b].x -= packing.size[a] * force * to.x;
      push[b].y -= packing.size[a] * force * to.y;
    }
  }
  for (std::size_t a = 0; a < packing.at.size(); ++a) {
    Vec& at = packing.at[a];
    const double size = packing.size[a];
    const double depth = -body.distance(at.x, at.y);
    if (depth < kRange * size) {
      const Vec out = GradientOf(body, at);
      const double force = size * PushAt(std::max(2 * depth, 0.0) / size);
      push[a].x -= force * out.x;
      push[a].y -= force * out.y;
    }
    const double length = std::hypot(push[a].x, push[a].y);
    const double most = .2 * size;
    const double scale = length * step > most ? most / length : step;
    at.x += scale * push[a].x;
    at.y += scale * push[a].y;
    const double outside = body.distance(at.x, at.y) + .05 * size;
    if (outside > 0) {
      const Vec out = GradientOf(body, at);
      at.x -= outside * out.x;
      at.y -= outside * out.y;
    }
  }
}

double AreaOf(const Body& body) {
  constexpr int kSamples = 400;
  int inside = 0;
  for (int j = 0; j < kSamples; ++j) {
    for (int i = 0; i < kSamples; ++i) {
      const double x = ((i + .5) / kSamples * 2 - 1) * body.extent;
      const double y = ((j + .5) / kSamples * 2 - 1) * body.extent;
      inside += body.distance(x, y) < 0;
    }
  }
  return 4 * body.extent * body.extent * inside / (double{kSamples} * kSamples);
}

}  // namespace

Body DiscBody(double radius) {
  return {[radius](double x, double y) { return std::hypot(x, y) - radius; }, radius};
}

Body SquareBody(double half_side, double corner) {
  return {[=](double x, double y) {
            const double dx = std::abs(x) - half_side + corner;
            const double dy = std::abs(y) - half_side + corner;
            return std::hypot(std::max(dx, 0.0), std::max(dy, 0.0)) +
                   std::min(std::max(dx, dy), 0.0) - corner;
          },
          half_side};
}

Body WavyBody(double radius, int waves, double height) {
  return {[=](double x, double y) {
            const double angle = std::atan2(y, x);
            const bool is_inside = std::hypot(x, y) < radius + height * std::cos(waves * angle);
            // Follows the outline to the nearest point, by Gauss and Newton.
            double at = angle, distance = 0;
            for (int step = 0; step < 8; ++step) {
              const double r = radius + height * std::cos(waves * at);
              const double slope = -height * waves * std::sin(waves * at);
              const double cosine = std::cos(at), sine = std::sin(at);
              const Vec to{x - r * cosine, y - r * sine};
              const Vec along{slope * cosine - r * sine, slope * sine + r * cosine};
              distance = std::hypot(to.x, to.y);
              at += (to.x * along.x + to.y * along.y) / (r * r + slope * slope);
            }
            return is_inside ? -distance : distance;
          },
          radius + height};
}

Particles Filled(const Body& body, Random& random, const DrawSize& draw) {
  Packing packing;
  for (double left = AreaOf(body); left > 0;) {
    const double x = random.Uniform(-body.extent, body.extent);
    const double y = random.Uniform(-body.extent, body.extent);
    if (body.distance(x, y) > 0) continue;
    const double size = draw(random, x, y);
    if (size == 0) continue;
    packing.at.push_back({x, y});
    packing.size.push_back(size);
    left -= size * size;
  }
  for (int step = 0; step < kSteps; ++step) {
    if (step % kStepsOfSearch == 0) packing.FindNear();
    Relax(body, step < kSteps / 2 ? .3 : .15, packing);
  }
  Particles particles;
  for (std::size_t k = 0; k < packing.at.size(); ++k) {
    particles.Add(packing.at[k].x, packing.at[k].y);
    particles.volumes.push_back(static_cast<float>(packing.size[k] * packing.size[k]));
  }
  return particles;
}

Particles RandomSizes(std::uint64_t seed, double smallest, double ratio) {
  Random random(seed);
  Particles particles = RandomScene(seed);
  particles.volumes.clear();
  const bool is_bidisperse = random.Chance(.3);
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double power = is_bidisperse ? std::floor(random.Uniform(0, 2)) : random.Unit();
    const double size = smallest * std::pow(ratio, power);
    particles.volumes.push_back(static_cast<float>(size * size));
  }
  return particles;
}

Particles Shaken(Particles particles, Random& random, double noise) {
  for (std::size_t k = 0; k < particles.xy.size(); ++k) {
    const double size = std::sqrt(double{particles.volumes[k / 2]});
    const double range = noise * size * std::numbers::sqrt3;
    particles.xy[k] += random.Uniform(-range, range);
  }
  return particles;
}

}  // namespace partiemc::support
