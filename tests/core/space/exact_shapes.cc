#include "space/exact_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>

namespace partiemc::support {
namespace {

using support::Random;

Vec3 RandomDirection(Random& random) {
  for (;;) {
    const double x = random.Uniform(-1, 1), y = random.Uniform(-1, 1);
    const Vec3 v{x, y, random.Uniform(-1, 1)};
    if (Dot(v, v) < 1 && Dot(v, v) > .01) return Normalised(v);
  }
}

/// Three perpendicular unit vectors.
struct Axes {
  Vec3 u, v, w;

  static Axes Around(const Vec3& w) {
    const Vec3 u = Normalised(Cross(w, std::abs(w.x) < .8 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    return {u, Cross(w, u), w};
  }
  static Axes Random(Random& random) {
    const Axes axes = Around(RandomDirection(random));
    const double turn = random.Uniform(0, 2 * std::numbers::pi);
    const Vec3 u = std::cos(turn) * axes.u + std::sin(turn) * axes.v;
    return {u, Cross(axes.w, u), axes.w};
  }
  Vec3 In(const Vec3& at) const { return {Dot(at, u), Dot(at, v), Dot(at, w)}; }
  Vec3 Out(const Vec3& at) const { return at.x * u + at.y * v + at.z * w; }
};

class Sphere : public ExactShape {
 public:
  explicit Sphere(double radius) : radius_(radius) {}
  double Distance(const Vec3& at) const override { return Length(at - centre) - radius_; }
  double Volume() const override { return 4 * std::numbers::pi / 3 * std::pow(radius_, 3); }
  double Reach() const override { return radius_; }
  Vec3 PointOnSurface(Random& random) const override {
    return centre + radius_ * RandomDirection(random);
  }

 private:
  double radius_;
};

class Torus : public ExactShape {
 public:
  Torus(const Vec3& axis, double large, double small)
      : axes_(Axes::Around(axis)), large_(large), small_(small) {}
  double Distance(const Vec3& at) const override {
    const Vec3 in = axes_.In(at - centre);
    return std::hypot(std::hypot(in.x, in.y) - large_, in.z) - small_;
  }
  double Volume() const override {
    return 2 * std::numbers::pi * std::numbers::pi * large_ * small_ * small_;
  }
  double Reach() const override { return large_ + small_; }
  Vec3 PointOnSurface(Random& random) const override {
    const double a = random.Uniform(0, 2 * std::numbers::pi);
    const double b = random.Uniform(0, 2 * std::numbers::pi);
    const double from_axis = large_ + small_ * std::cos(b);
    return centre +
           axes_.Out({from_axis * std::cos(a), from_axis * std::sin(a), small_ * std::sin(b)});
  }

 private:
  Axes axes_;
  double large_, small_;
};

class TurnedBox : public ExactShape {
 public:
  TurnedBox(const Vec3& half, Random& random) : axes_(Axes::Random(random)), half_(half) {}
  double Distance(const Vec3& at) const override {
    const Vec3 in = axes_.In(at - centre);
    const double x = std::abs(in.x) - half_.x, y = std::abs(in.y) - half_.y,
                 z = std::abs(in.z) - half_.z;
    const Vec3 outside{std::max(x, 0.0), std::max(y, 0.0), std::max(z, 0.0)};
    return Length(outside) + std::min(std::max({x, y, z}), 0.0);
  }
  double Volume() const override { return 8 * half_.x * half_.y * half_.z; }
  double Reach() const override { return Length(half_); }
  Vec3 PointOnSurface(Random& random) const override {
    std::array<double, 3> at{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
    // A face, an edge or a corner.
    for (std::size_t sides = 1 + random.Below(3); sides > 0; --sides) {
      const std::size_t axis = random.Below(3);
      at[axis] = at[axis] < 0 ? -1 : 1;
    }
    return centre + axes_.Out({half_.x * at[0], half_.y * at[1], half_.z * at[2]});
  }

 private:
  Axes axes_;
  Vec3 half_;
};

Vec3 GradientOf(const ExactShape& shape, const Vec3& at) {
  constexpr double kStep = 1e-4;
  const auto along = [&](const Vec3& by) {
    return shape.Distance(at + by) - shape.Distance(at - by);
  };
  return (1 / (2 * kStep)) * Vec3{along({kStep, 0, 0}), along({0, kStep, 0}), along({0, 0, kStep})};
}

using Key = std::array<int, 3>;
Key KeyOf(const Vec3& at, double size) {
  return {static_cast<int>(std::floor(at.x / size)), static_cast<int>(std::floor(at.y / size)),
          static_cast<int>(std::floor(at.z / size))};
}

/// Calls visit(index) for entries in the cell of a point and around it.
template <typename Visit>
void VisitNear(const std::map<Key, std::vector<std::size_t>>& grid, const Vec3& at, double size,
               Visit visit) {
  const Key key = KeyOf(at, size);
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const auto found = grid.find({key[0] + x, key[1] + y, key[2] + z});
        if (found == grid.end()) continue;
        for (const std::size_t index : found->second) visit(index);
      }
    }
  }
}

/// One round: particles repel each other, and their mirror images behind the boundary.
void Repel(const ExactShape& shape, SpaceParticles& particles) {
  constexpr double kReach = 1.5, kStrength = .35;
  std::map<Key, std::vector<std::size_t>> grid;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    grid[KeyOf(particles.At(k), kReach)].push_back(k);
  }
  std::vector<double> moved;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const Vec3 at = particles.At(k);
    Vec3 push;
    const auto add = [&](const Vec3& other) {
      const Vec3 to = at - other;
      const double distance = Length(to);
      if (distance >= kReach || distance == 0) return;
      const double size = 1 - distance / kReach;
      push = push + (size * size / distance) * to;
    };
    VisitNear(grid, at, kReach, [&](std::size_t other) {
      const Vec3 neighbour = particles.At(other);
      if (other != k) add(neighbour);
      const double depth = shape.Distance(neighbour);
      if (depth > -kReach) add(neighbour - 2 * depth * GradientOf(shape, neighbour));
    });
    Vec3 to = at + kStrength * push;
    const double outside = shape.Distance(to) + .3;
    if (outside > 0) to = to - outside * GradientOf(shape, to);
    moved.insert(moved.end(), {to.x, to.y, to.z});
  }
  particles.xyz = moved;
}

}  // namespace

double DistanceToTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto to_segment = [&](const Vec3& u, const Vec3& v) {
    const Vec3 along = v - u;
    const double t = std::clamp(Dot(p - u, along) / Dot(along, along), 0.0, 1.0);
    return Length(p - (u + t * along));
  };
  const Vec3 normal = Cross(b - a, c - a);
  const bool is_over = Dot(Cross(b - a, p - a), normal) >= 0 &&
                       Dot(Cross(c - b, p - b), normal) >= 0 &&
                       Dot(Cross(a - c, p - c), normal) >= 0;
  if (is_over) return std::abs(Dot(p - a, normal)) / Length(normal);
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

std::unique_ptr<ExactShape> MakeSphere(const Vec3& centre, double radius) {
  auto shape = std::make_unique<Sphere>(radius);
  shape->centre = centre;
  return shape;
}

std::unique_ptr<ExactShape> MakeTorus(const Vec3& centre, const Vec3& axis, double large,
                                      double small) {
  auto shape = std::make_unique<Torus>(axis, large, small);
  shape->centre = centre;
  return shape;
}

std::unique_ptr<ExactShape> MakeBox(const Vec3& centre, const Vec3& half, Random& random) {
  auto shape = std::make_unique<TurnedBox>(half, random);
  shape->centre = centre;
  return shape;
}

SpaceParticles Fill(const ExactShape& shape, Sampler sampler, Random& random) {
  const Axes axes = Axes::Random(random);
  const double shake = sampler == Sampler::kLattice ? 0 : .2;
  const int reach = static_cast<int>(shape.Reach()) + 2;
  SpaceParticles particles;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Vec3 at = shape.centre + axes.Out({x + .3, y + .1, z + .2});
        if (shape.Distance(at) >= 0) continue;
        const double dx = random.Uniform(-shake, shake), dy = random.Uniform(-shake, shake);
        particles.Add(at + Vec3{dx, dy, random.Uniform(-shake, shake)});
      }
    }
  }
  if (sampler == Sampler::kRelaxed) {
    for (int round = 0; round < 40; ++round) Repel(shape, particles);
  }
  return particles;
}

SurfaceError ErrorOf(const Surface& surface, const ExactShape& shape, std::size_t particles,
                     Random& random) {
  constexpr double kSize = 2;  // Longer than the sides of triangles.
  SurfaceError error;
  std::map<Key, std::vector<std::size_t>> grid;
  double area = 0;
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    std::array<Vec3, 3> at;
    for (int k = 0; k < 3; ++k) at[k] = Vec3At(surface.points, surface.triangles[3 * t + k]);
    const double size = Length(Cross(at[1] - at[0], at[2] - at[0])) / 2;
    const Vec3 centre = (1.0 / 3) * (at[0] + at[1] + at[2]);
    grid[KeyOf(centre, kSize)].push_back(t);
    double sum = 0;
    for (const Vec3& corner : at) {
      // Points in the middle of thirds of the triangle, and for the largest distance its corners.
      sum += std::abs(shape.Distance(.5 * (corner + centre))) / 3;
      error.hausdorff = std::max(error.hausdorff, std::abs(shape.Distance(corner)));
    }
    error.hausdorff = std::max(error.hausdorff, std::abs(shape.Distance(centre)));
    error.mean += size * sum;
    area += size;
  }
  error.mean /= area;
  double volume = 0;
  for (const ShellMeasures& shell : surface.measures) volume += shell.volume;
  error.volume = volume / static_cast<double>(particles) - 1;

  for (int k = 0; k < 3'000; ++k) {
    const Vec3 point = shape.PointOnSurface(random);
    double least = kSize;
    VisitNear(grid, point, kSize, [&](std::size_t t) {
      least = std::min(least,
                       DistanceToTriangle(point, Vec3At(surface.points, surface.triangles[3 * t]),
                                          Vec3At(surface.points, surface.triangles[3 * t + 1]),
                                          Vec3At(surface.points, surface.triangles[3 * t + 2])));
    });
    error.hausdorff = std::max(error.hausdorff, least);
  }
  for (std::size_t p = 0; p < surface.PointCount(); ++p) {
    const Vec3 normal{surface.normals[3 * p], surface.normals[3 * p + 1],
                      surface.normals[3 * p + 2]};
    const Vec3 truth = Normalised(GradientOf(shape, Vec3At(surface.points, p)));
    error.normals += Length(normal - truth) / static_cast<double>(surface.PointCount());
  }
  return error;
}

}  // namespace partiemc::support
