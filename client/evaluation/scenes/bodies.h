// Merging and splitting bodies: the exact outline of their union, and particles for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client/evaluation/scenes/motion.h"
#include "client/evaluation/scenes/outline.h"

namespace partiemc::evaluation {

/// The boundary of the union of the bodies in frame `frame`, lengths in spacings. Exact up to the
/// sampling of curves (kCurveStep); crossings of two outlines are points of the result.
/// Requires: outlines cross properly or not at all, and no three in one point.
Outline UnionOutline(const std::vector<Body>& bodies, std::size_t frame);

/// Particles by place, and by what tells each of them apart in every frame.
struct KnownParticles {
  std::vector<Point> points;
  std::vector<std::uint64_t> ids;
};

/// The particles of all bodies in frame `frame` that belong to their union: each body moves with
/// its own particles (`samples[k]`, relative to the centre of body k), and where bodies overlap
/// only those of the first of them remain. An id is the number of the sample, those of the bodies
/// before it counted first.
KnownParticles UnionParticles(const std::vector<Body>& bodies,
                              const std::vector<std::vector<Point>>& samples, std::size_t frame);

}  // namespace partiemc::evaluation
