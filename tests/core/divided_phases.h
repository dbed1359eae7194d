// Frames of several phases, and a check that their outlines divide the body.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

#include "core/boxes.h"
#include "partiemc/partiemc.h"
#include "support/particles.h"
#include "support/random.h"

namespace partiemc {

/// A stream with an outline for each of the phases 1 to `count`.
inline ReconstructionParameters WithPhases(int count) {
  ReconstructionParameters parameters{.spacing = 1.0};
  for (std::int32_t phase = 1; phase <= count; ++phase) {
    parameters.sections.push_back({.phase = phase});
  }
  return parameters;
}

/// Gives the particles of a frame phases from 1 to `count`: by sectors, stripes, drops or at
/// random.
inline void DrawPhases(support::Random& random, int count, support::Particles& particles) {
  const std::size_t kind = random.Below(4);
  const double width = random.Uniform(1, 12), angle = random.Uniform(0, 7);
  const double cx = particles.size() > 0 ? particles.x(0) : 0;
  const double cy = particles.size() > 0 ? particles.y(0) : 0;
  const double noise = random.Chance(.3) ? random.Uniform(0, 2) : 0;
  particles.phases.clear();
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double shift_x = random.Uniform(-noise, noise), shift_y = random.Uniform(-noise, noise);
    const double x = particles.x(k) - cx + shift_x, y = particles.y(k) - cy + shift_y;
    double place = 0;
    if (kind == 0) {
      place = (std::atan2(y, x) + angle) * count / 6.3;
    } else if (kind == 1) {
      place = (x * std::cos(angle) + y * std::sin(angle)) / width;
    } else if (kind == 2) {
      place = std::floor(x / width) + std::floor(y / width);
    } else {
      place = static_cast<double>(random.Below(1'000));
    }
    const auto cell = static_cast<std::int64_t>(std::floor(place));
    particles.phases.push_back(static_cast<float>(1 + ((cell % count) + count) % count));
  }
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

}  // namespace partiemc
