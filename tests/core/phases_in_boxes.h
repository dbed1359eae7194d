// Particles of several phases in periodic boxes, and checks of their outlines.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/boxes.h"
#include "core/divided_phases.h"
#include "partiemc/partiemc.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc {

inline constexpr double kPhaseLength = 48, kPhaseHeight = 40;

inline PeriodicBox PhaseCell(double x = 0, double y = 0, bool wraps = false) {
  PeriodicBox box = BoxOf(kPhaseLength, kPhaseHeight, x, y);
  box.wraps = wraps;
  return box;
}

/// A box that is periodic along x only.
inline PeriodicBox PhaseChannel(double x = 0, bool wraps = false) {
  PeriodicBox box{.axes = {PeriodicAxis{x, kPhaseLength}, std::nullopt, std::nullopt}};
  box.wraps = wraps;
  return box;
}

inline ReconstructionParameters PhasesIn(const PeriodicBox& box, int count) {
  ReconstructionParameters parameters = In(box);
  for (std::int32_t phase = 1; phase <= count; ++phase) {
    parameters.sections.push_back({.phase = phase});
  }
  return parameters;
}

using PhaseAt = std::function<int(double x, double y)>;

/// A lattice of `columns` x `rows` particles from the origin, shaken by up to `noise`.
inline support::Particles Labelled(int columns, int rows, double noise, const PhaseAt& phase_at) {
  support::Random random(5);
  support::Particles particles;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double x = i + .5, y = j + .5, dx = random.Uniform(-noise, noise);
      particles.Add(x + dx, y + random.Uniform(-noise, noise));
      particles.phases.push_back(static_cast<float>(phase_at(x, y)));
    }
  }
  return particles;
}

inline double CountOf(const support::Particles& particles, float phase) {
  return static_cast<double>(std::ranges::count(particles.phases, phase));
}

/// The number of outer rings that have an identity: the largest piece of each body.
inline std::size_t BodiesOf(const Rings& rings) {
  std::size_t count = 0;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    count += rings.outer_of[ring] == kNoRing && rings.measures[ring].identity != 0 ? 1 : 0;
  }
  return count;
}

}  // namespace partiemc
