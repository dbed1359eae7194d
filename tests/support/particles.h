// Test frames: shapes, degenerate sets, and seeded random scenes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "partiemc/frame.h"
#include "support/random.h"

namespace partiemc::support {

/// A frame that owns its particles.
struct Particles {
  std::vector<double> xy;
  std::vector<float> volumes;      ///< Empty, or one per particle.
  std::vector<std::uint64_t> ids;  ///< Empty, or one per particle.
  std::vector<float> velocities;   ///< Empty, or x, y per particle.
  std::vector<float> phases;       ///< Empty, or one per particle: the attribute "phase".
  double time = 0;

  std::size_t size() const { return xy.size() / 2; }
  double x(std::size_t k) const { return xy[2 * k]; }
  double y(std::size_t k) const { return xy[2 * k + 1]; }
  void Add(double px, double py) {
    xy.push_back(px);
    xy.push_back(py);
  }
  /// Adds particles with their ids, velocities and phases.
  void Add(const Particles& others);
  /// A view; valid while this object exists and does not change.
  Frame AsFrame() const;

  mutable std::vector<Attribute> attributes;  ///< Set by AsFrame.
};

// Shapes filled with particles at the nodes of a lattice of spacing 1, unless stated otherwise.

/// Particles at (x0 + i, y0 + j).
Particles Lattice(int columns, int rows, double x0 = 0, double y0 = 0);
Particles Disc(double radius, double cx = 0, double cy = 0);
/// Between two circles around the origin.
Particles Annulus(double inner, double outer);
/// Particles with y <= 0 below a straight boundary: `columns` of them in `rows` layers.
Particles HalfPlane(int columns, int rows);

/// A jittered body with a wavy outline of about `radius` and a few holes.
Particles Blob(Random& random, double radius);
/// One or two layers of particles along a wave.
Particles Sheet(Random& random, int length);
Particles Noise(Random& random, std::size_t count, double extent);
/// Uneven steps along one line of random direction.
Particles Collinear(Random& random, std::size_t count);
Particles Clusters(Random& random, std::size_t clusters, double extent);

/// A mixture of the shapes above, sometimes with duplicates, spray and volumes, near the origin or
/// up to a million spacings from it.
Particles RandomScene(std::uint64_t seed);

/// Frame `frame` of a wavy body with a hole that turns, drifts, stretches and sheds fragments.
Particles MovingBody(int frame);

// Metamorphic changes.

Particles Shifted(Particles particles, double dx, double dy);
/// Positions times `factor`, volumes times its square.
Particles Scaled(Particles particles, double factor);
Particles Permuted(const Particles& particles, Random& random);
/// Moves each particle by up to `most` along each axis.
Particles Jittered(Particles particles, Random& random, double most);
/// Repeats some of the particles at the same positions.
Particles WithDuplicates(Particles particles, Random& random, std::size_t count);
/// Positions rounded to the precision of the bins: multiples of 2^-17 cells.
Particles Snapped(Particles particles, double cell_size);

}  // namespace partiemc::support
