// Shapes with exact distances, particles that fill them, and the error of surfaces of them.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface.h"
#include "space/space_particles.h"
#include "support/random.h"

namespace partiemc::support {

/// A solid in general position. Lengths in spacings.
class ExactShape {
 public:
  virtual ~ExactShape() = default;
  virtual double Distance(const Vec3& at) const = 0;  ///< Negative inside.
  virtual double Volume() const = 0;
  virtual double Reach() const = 0;                                ///< Radius around `centre`.
  virtual Vec3 PointOnSurface(support::Random& random) const = 0;  ///< Also on edges, if any.

  Vec3 centre;
};

std::unique_ptr<ExactShape> MakeSphere(const Vec3& centre, double radius);
/// `axis` of length 1.
std::unique_ptr<ExactShape> MakeTorus(const Vec3& centre, const Vec3& axis, double large,
                                      double small);
/// Turned by a random rotation.
std::unique_ptr<ExactShape> MakeBox(const Vec3& centre, const Vec3& half, support::Random& random);

/// The distance of `p` from a triangle.
double DistanceToTriangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

enum class Sampler { kLattice, kJittered, kRelaxed };

/// Particles of volume 1: a turned lattice, the same shaken by .2, or repelled from each other and
/// from the boundary until they are even.
SpaceParticles Fill(const ExactShape& shape, Sampler sampler, support::Random& random);

struct SurfaceError {
  double mean = 0;       ///< Mean distance of the surface from the shape.
  double hausdorff = 0;  ///< Largest distance in both directions.
  double normals = 0;    ///< Mean length of the error of normals at points, without edges.
  double volume = 0;     ///< Relative to the number of particles.
};
SurfaceError ErrorOf(const Surface& surface, const ExactShape& shape, std::size_t particles,
                     support::Random& random);

}  // namespace partiemc::support
