// Particles of several phases in periodic boxes, and checks of their outlines.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/boxes.h"
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

using SegmentEnd = std::pair<double, double>;

struct FaceSegments {
  std::multiset<std::pair<SegmentEnd, SegmentEnd>> free;
  std::map<std::pair<int, double>, double> cut;  // By axis and coordinate of a face: the length.
};

inline FaceSegments FaceSegmentsOf(const Rings& rings) {
  FaceSegments segments;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      const std::uint32_t next = k + 1 < rings.offsets[ring + 1] ? k + 1 : rings.offsets[ring];
      const SegmentEnd from{rings.points[2 * k], rings.points[2 * k + 1]};
      const SegmentEnd to{rings.points[2 * next], rings.points[2 * next + 1]};
      if (!std::ranges::binary_search(rings.cuts, k)) {
        segments.free.insert({from, to});
      } else if (from.first == to.first) {
        segments.cut[{0, from.first}] += std::abs(to.second - from.second);
      } else {
        EXPECT_EQ(from.second, to.second);
        segments.cut[{1, from.second}] += std::abs(to.first - from.first);
      }
    }
  }
  return segments;
}

/// Checks that the phases divide the body. Each result is valid, the areas add up, and each segment
/// that is not cut belongs to the body or, reversed and bit for bit, to another phase. The cut
/// segments of the phases lie on the same lines as those of the body and have the same length.
inline void ExpectDivided(const Result& result, Fill fill) {
  ExpectValid(result, fill);
  double area = 0;
  std::size_t count = 0;
  std::multiset<std::pair<SegmentEnd, SegmentEnd>> inner;
  std::map<std::pair<int, double>, double> cut;
  const FaceSegments of_body = FaceSegmentsOf(result.rings);
  for (const Result& phase : result.sections) {
    ExpectValid(phase, fill);
    area += phase.statistics.area;
    const FaceSegments of_phase = FaceSegmentsOf(phase.rings);
    for (const auto& segment : of_phase.free) {
      const bool is_outer = of_body.free.contains(segment);
      count += is_outer ? 1 : 0;
      if (!is_outer) inner.insert(segment);
    }
    for (const auto& [face, length] : of_phase.cut) cut[face] += length;
  }
  EXPECT_NEAR(area, result.statistics.area, 1e-9 * std::max(1.0, area));
  EXPECT_EQ(count, of_body.free.size());
  for (const auto& [from, to] : inner) {
    EXPECT_EQ(inner.count({to, from}), 1u) << from.first << ", " << from.second;
  }
  EXPECT_EQ(cut.size(), of_body.cut.size());
  for (const auto& [face, length] : of_body.cut) {
    EXPECT_NEAR(cut[face], length, 1e-9 * std::max(1.0, length)) << face.first << face.second;
  }
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
