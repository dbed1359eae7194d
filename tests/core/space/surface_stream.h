// A stream of frames in space, with its shells by position.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface_reconstructor.h"
#include "space/space_particles.h"
#include "support/random.h"
#include "support/tracked_scene.h"

namespace partiemc::support {

/// Bodies whose particles have ids, velocities, both or neither.
struct TrackedParticles {
  support::Known known;
  double time = 0;
  std::vector<double> xyz;
  std::vector<std::uint64_t> ids;
  std::vector<float> velocities, pressure;
  std::vector<Attribute> attributes;

  /// Adds a body, moved by `shift`, with ids from `first_id`.
  void Add(const SpaceParticles& body, std::uint64_t first_id, const Vec3& velocity = {},
           const Vec3& shift = {}) {
    for (std::size_t k = 0; k < body.size(); ++k) {
      const Vec3 at = body.At(k) + shift;
      xyz.insert(xyz.end(), {at.x, at.y, at.z});
      pressure.push_back(static_cast<float>(at.x - 2 * at.y + at.z));
      if (known.ids) ids.push_back(first_id + k);
      if (!known.velocities) continue;
      for (const double along : {velocity.x, velocity.y, velocity.z}) {
        velocities.push_back(static_cast<float>(along));
      }
    }
  }

  /// A view; valid as long as this object is and does not change.
  Frame AsFrame(bool has_attributes = false) {
    attributes.clear();
    if (has_attributes) attributes.push_back({"pressure", 1, pressure});
    return {.positions = std::span<const double>(xyz),
            .components = 3,
            .ids = ids,
            .velocities = velocities,
            .attributes = attributes,
            .time = time};
  }

  TrackedParticles Permuted(support::Random& random) const {
    TrackedParticles all = *this;
    for (std::size_t k = xyz.size() / 3; k > 1; --k) {
      const std::size_t a = k - 1, b = random.Below(k);
      const auto swap = [&](auto& values, std::size_t count) {
        for (std::size_t c = 0; c < count && !values.empty(); ++c) {
          std::swap(values[count * a + c], values[count * b + c]);
        }
      };
      swap(all.xyz, 3);
      swap(all.ids, 1);
      swap(all.velocities, 3);
      swap(all.pressure, 1);
    }
    return all;
  }
};

/// With spacing 1.
class SurfaceStream {
 public:
  explicit SurfaceStream(SurfaceParameters parameters = {})
      : reconstructor_(*SurfaceReconstructor::Create(parameters)) {}

  /// Fails the test if the frame is refused.
  const Surface& Next(TrackedParticles particles, bool has_attributes = false) {
    const absl::Status status = Try(particles.AsFrame(has_attributes));
    EXPECT_TRUE(status.ok()) << status;
    return surface_;
  }
  absl::Status Try(const Frame& frame, const FrameControl& control = {}) {
    return reconstructor_.Reconstruct(frame, state_, workspace_, surface_, control);
  }
  const SurfaceReconstructor& reconstructor() const { return reconstructor_; }
  const Surface& surface() const { return surface_; }
  SurfaceState& state() { return state_; }

  /// The body, or the cavity, whose centroid is nearest to `at`.
  std::size_t Shell(const Vec3& at, bool is_cavity = false) const {
    std::size_t nearest = surface_.ShellCount();
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t shell = 0; shell < surface_.ShellCount(); ++shell) {
      if ((surface_.outer_of[shell] != kNoShell) != is_cavity) continue;
      const ShellMeasures& m = surface_.measures[shell];
      const double distance = Length(Vec3{m.centroid_x, m.centroid_y, m.centroid_z} - at);
      if (distance >= least) continue;
      least = distance;
      nearest = shell;
    }
    return nearest;
  }
  std::uint64_t Identity(const Vec3& at, bool is_cavity = false) const {
    return surface_.measures.at(Shell(at, is_cavity)).identity;
  }
  std::vector<std::uint64_t> Parents(const Vec3& at, bool is_cavity = false) const {
    const auto parents = surface_.ParentsOf(Shell(at, is_cavity));
    return {parents.begin(), parents.end()};
  }

 private:
  SurfaceReconstructor reconstructor_;
  SurfaceState state_;
  SurfaceWorkspace workspace_;
  Surface surface_;
};

}  // namespace partiemc::support
