// Particles of different sizes in space: filled bodies and random scenes.
#pragma once

#include <cstdint>
#include <functional>

#include "base/vec3.h"
#include "partiemc/surface.h"
#include "space/exact_shapes.h"
#include "space/space_particles.h"
#include "support/random.h"

namespace partiemc::support {

/// Draws the size of a particle at a point; 0: there is none. Zones of large particles need fewer.
using DrawSize = std::function<double(support::Random& random, const Vec3& at)>;

/// Fills a shape with particles until their volumes h_i^3 make up its volume. Moves them apart
/// until pairs are about (h_i + h_j) / 2 apart, and the outermost particles half their size from
/// the boundary. The counterpart of support::Filled in space.
SpaceParticles FillSized(const ExactShape& shape, support::Random& random, const DrawSize& draw);

/// A scene of RandomSpaceScene, with sizes within a factor of `ratio` of each other.
SpaceParticles RandomSizedScene(std::uint64_t seed, double ratio);

/// Moves particles at random. The standard deviation along each axis is `noise` times their size.
SpaceParticles Shaken(SpaceParticles particles, support::Random& random, double noise);

SpaceParticles MovedBy(SpaceParticles particles, const Vec3& by);

/// Adds particles with their volumes.
void AddSized(SpaceParticles& scene, const SpaceParticles& others);

double SumOfVolumes(const SpaceParticles& particles);

/// Gives each particle a random size between the limits, then scales all, so that the mean volume
/// is 1.
void DrawSizes(SpaceParticles& particles, double low, double high, support::Random& random);

/// The cube root of the mean volume.
double MeanSpacing(const SpaceParticles& particles);

/// The mean distance of a surface from the shape in local sizes, over its area. A local size is the
/// mean size of the particles around a point, weighted by their kernels.
double SizedDeviation(const Surface& surface, const ExactShape& shape,
                      const SpaceParticles& particles);

}  // namespace partiemc::support
