#include "support/particles.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace partiemc::support {
namespace {

// Calls visit(x, y) for the integer points of a square of half side `radius` around the origin.
template <typename Visit>
void ForEachNode(double radius, Visit visit) {
  const int reach = static_cast<int>(std::ceil(radius));
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) visit(static_cast<double>(i), static_cast<double>(j));
  }
}

Particles AnyShape(Random& random) {
  switch (random.Below(7)) {
    case 0:
      return Lattice(1 + static_cast<int>(random.Below(20)),
                     1 + static_cast<int>(random.Below(20)));
    case 1:
      return Blob(random, random.Uniform(4, 11));
    case 2:
      return Sheet(random, 10 + static_cast<int>(random.Below(40)));
    case 3:
      return Noise(random, 1 + random.Below(250), random.Uniform(2, 25));
    case 4:
      return Collinear(random, 2 + random.Below(40));
    case 5:
      return Clusters(random, 1 + random.Below(5), 20);
    default:
      return Annulus(random.Uniform(0.5, 5), random.Uniform(5, 10));
  }
}

}  // namespace

void Particles::Add(const Particles& others) {
  xy.insert(xy.end(), others.xy.begin(), others.xy.end());
  ids.insert(ids.end(), others.ids.begin(), others.ids.end());
  velocities.insert(velocities.end(), others.velocities.begin(), others.velocities.end());
  phases.insert(phases.end(), others.phases.begin(), others.phases.end());
}

Frame Particles::AsFrame() const {
  Frame frame;
  frame.positions = std::span<const double>(xy);
  frame.volumes = volumes;
  frame.ids = ids;
  frame.velocities = velocities;
  attributes.clear();
  if (!phases.empty()) attributes.push_back({.name = "phase", .values = phases});
  frame.attributes = attributes;
  frame.time = time;
  return frame;
}

Particles Lattice(int columns, int rows, double x0, double y0) {
  Particles particles;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) particles.Add(x0 + i, y0 + j);
  }
  return particles;
}

Particles Disc(double radius, double cx, double cy) {
  Particles particles;
  ForEachNode(radius, [&](double x, double y) {
    if (x * x + y * y <= radius * radius) particles.Add(cx + x, cy + y);
  });
  return particles;
}

Particles Annulus(double inner, double outer) {
  Particles particles;
  ForEachNode(outer, [&](double x, double y) {
    const double square = x * x + y * y;
    if (square >= inner * inner && square <= outer * outer) particles.Add(x, y);
  });
  return particles;
}

Particles HalfPlane(int columns, int rows) { return Lattice(columns, rows, 0, 1 - rows); }

Particles Blob(Random& random, double radius) {
  struct Hole {
    double x, y, radius;
  };
  std::vector<Hole> holes(random.Below(4));
  for (Hole& hole : holes) {
    hole = {random.Uniform(-radius, radius) / 2, random.Uniform(-radius, radius) / 2,
            random.Uniform(0.5, radius / 3)};
  }
  const double waves = static_cast<double>(2 + random.Below(5));
  const double depth = random.Uniform(0, 0.4);
  const double phase = random.Uniform(0, 2 * std::numbers::pi);
  const double jitter = random.Uniform(0, 0.3);
  Particles particles;
  ForEachNode(1.5 * radius, [&](double x, double y) {
    const double edge = radius * (1 + depth * std::sin(waves * std::atan2(y, x) + phase));
    if (x * x + y * y > edge * edge) return;
    for (const Hole& hole : holes) {
      if (std::hypot(x - hole.x, y - hole.y) < hole.radius) return;
    }
    particles.Add(x + random.Uniform(-jitter, jitter), y + random.Uniform(-jitter, jitter));
  });
  return particles;
}

Particles Sheet(Random& random, int length) {
  const double height = random.Uniform(0, 4);
  const double wave = random.Uniform(0.05, 0.5);
  const int layers = 1 + static_cast<int>(random.Below(2));
  Particles particles;
  for (int i = 0; i < length; ++i) {
    for (int layer = 0; layer < layers; ++layer) {
      particles.Add(i + random.Uniform(-0.1, 0.1), height * std::sin(wave * i) + layer);
    }
  }
  return particles;
}

Particles Noise(Random& random, std::size_t count, double extent) {
  Particles particles;
  for (std::size_t k = 0; k < count; ++k) {
    particles.Add(random.Uniform(-extent, extent), random.Uniform(-extent, extent));
  }
  return particles;
}

Particles Collinear(Random& random, std::size_t count) {
  const double angle = random.Uniform(0, std::numbers::pi);
  Particles particles;
  double along = 0;
  for (std::size_t k = 0; k < count; ++k) {
    particles.Add(along * std::cos(angle), along * std::sin(angle));
    along += random.Uniform(0.5, random.Chance(0.2) ? 6 : 1.5);
  }
  return particles;
}

Particles Clusters(Random& random, std::size_t clusters, double extent) {
  Particles particles;
  for (std::size_t c = 0; c < clusters; ++c) {
    particles.Add(Shifted(Noise(random, 1 + random.Below(30), random.Uniform(0.2, 3)),
                          random.Uniform(-extent, extent), random.Uniform(-extent, extent)));
  }
  return particles;
}

Particles RandomScene(std::uint64_t seed) {
  Random random(seed);
  Particles scene;
  for (std::size_t shapes = 1 + random.Below(3); shapes > 0; --shapes) {
    scene.Add(Shifted(AnyShape(random), random.Uniform(-15, 15), random.Uniform(-15, 15)));
  }
  if (random.Chance(0.3)) scene.Add(Noise(random, 1 + random.Below(20), 60));  // Spray.
  if (random.Chance(0.2)) scene = WithDuplicates(scene, random, 1 + random.Below(20));
  if (random.Chance(0.3)) {
    const double range = random.Chance(0.5) ? 1e6 : 100;
    scene = Shifted(scene, random.Uniform(-range, range), random.Uniform(-range, range));
  }
  if (random.Chance(0.3)) {
    const double range = random.Chance(0.5) ? 0.05 : 0.7;
    for (std::size_t k = 0; k < scene.size(); ++k) {
      scene.volumes.push_back(static_cast<float>(1 + random.Uniform(-range, range)));
    }
  }
  return scene;
}

Particles MovingBody(int frame) {
  Random random(99);
  Particles body = Blob(random, 9);
  body.Add(Shifted(Disc(2), 16, 3));
  const double angle = 0.11 * frame;
  const double stretch = 1 + 0.02 * frame;
  for (std::size_t k = 0; k < body.size(); ++k) {
    const double x = body.x(k) * stretch;
    const double y = body.y(k) / stretch;
    body.xy[2 * k] = x * std::cos(angle) - y * std::sin(angle) + 0.37 * frame;
    body.xy[2 * k + 1] = x * std::sin(angle) + y * std::cos(angle) - 0.21 * frame;
  }
  return body;
}

Particles Shifted(Particles particles, double dx, double dy) {
  for (std::size_t k = 0; k < particles.xy.size(); k += 2) {
    particles.xy[k] += dx;
    particles.xy[k + 1] += dy;
  }
  return particles;
}

Particles Scaled(Particles particles, double factor) {
  for (double& coordinate : particles.xy) coordinate *= factor;
  for (float& volume : particles.volumes) volume = static_cast<float>(volume * factor * factor);
  return particles;
}

Particles Permuted(const Particles& particles, Random& random) {
  std::vector<std::size_t> order(particles.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    order[k] = k;
    std::swap(order[k], order[random.Below(k + 1)]);
  }
  Particles permuted;
  permuted.time = particles.time;
  for (const std::size_t k : order) {
    permuted.Add(particles.x(k), particles.y(k));
    if (!particles.volumes.empty()) permuted.volumes.push_back(particles.volumes[k]);
    if (!particles.ids.empty()) permuted.ids.push_back(particles.ids[k]);
    if (!particles.phases.empty()) permuted.phases.push_back(particles.phases[k]);
    if (!particles.velocities.empty()) {
      permuted.velocities.push_back(particles.velocities[2 * k]);
      permuted.velocities.push_back(particles.velocities[2 * k + 1]);
    }
  }
  return permuted;
}

Particles Jittered(Particles particles, Random& random, double most) {
  for (double& coordinate : particles.xy) coordinate += random.Uniform(-most, most);
  return particles;
}

Particles WithDuplicates(Particles particles, Random& random, std::size_t count) {
  const std::size_t originals = particles.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t source = random.Below(originals);
    particles.Add(particles.x(source), particles.y(source));
    if (!particles.volumes.empty()) particles.volumes.push_back(particles.volumes[source]);
    if (!particles.phases.empty()) particles.phases.push_back(particles.phases[source]);
  }
  return particles;
}

Particles Snapped(Particles particles, double cell_size) {
  for (double& coordinate : particles.xy) {
    coordinate = std::floor(coordinate / cell_size * 0x1p17 + 0.5) * 0x1p-17 * cell_size;
  }
  return particles;
}

}  // namespace partiemc::support
