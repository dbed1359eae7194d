// One frame of particles, as the caller holds it. Nothing here owns memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"

namespace partiemc {

/// A quantity that particles carry, such as pressure or velocity.
struct Attribute {
  std::string_view name;          ///< Of this one alone, 1 to 64 bytes of printable ASCII.
  int components = 1;             ///< 1 to 3.
  std::span<const float> values;  ///< `components` per particle, interleaved. Finite.
};

/// Of all attributes of a frame: the most components together.
inline constexpr std::size_t kMostAttributeValues = 32;

/// Particles of one instant, each array in the same order. Views must outlive the call only.
struct Frame {
  /// Interleaved coordinates, `components` per particle, in world units. Finite.
  std::variant<std::span<const float>, std::span<const double>> positions;

  /// 2 (x, y) or 3 (x, y, z). With 3, all particles must lie in one plane parallel to the one
  /// that ReconstructionParameters::plane names, unless there is a `slice`, which wants 3.
  int components = 2;

  /// Area that each particle stands for, in world units squared, positive and finite. Empty: h^2.
  /// With a `slice` its volume, cubed, and h^3.
  std::span<const float> volumes = {};

  /// What the same particle has in every frame; no two particles of a frame share one. Empty: none.
  std::span<const std::uint64_t> ids = {};

  /// Interleaved as `positions`, in world units per unit of `time`. Finite. Empty: none.
  std::span<const float> velocities = {};

  /// What is wanted at the vertices, too (Result::attributes). Nothing else depends on it.
  std::span<const Attribute> attributes = {};

  /// Simulation time. Velocities count between frames of which the later one has the larger time.
  double time = 0;

  // Ids, velocities and time decide identities of rings (core/IDENTITIES.md); nothing
  // else depends on them.

  std::size_t ParticleCount() const {
    return std::visit([](auto view) { return view.size(); }, positions) /
           static_cast<std::size_t>(components);
  }
};

/// Names the velocities of a frame among its attributes.
inline constexpr std::string_view kVelocityAttribute = "velocity";

/// Sets `chosen` to those attributes of a frame that have these names, in their order:
/// kVelocityAttribute are Frame::velocities where there are any. Views, as the frame is.
/// Errors: INVALID_ARGUMENT with reason NO_SUCH_ATTRIBUTE, and a part of them in `chosen`. A frame
/// without particles lacks none.
absl::Status ChooseAttributes(const Frame& frame, std::span<const std::string> names,
                              std::vector<Attribute>& chosen);

/// What a frame may cost. A frame beyond a limit is refused before anything is allocated for it.
struct FrameLimits {
  /// The most that limits may be: all that is counted for such a frame fits into 32 bits.
  static constexpr std::size_t kMostParticles = 1'000'000'000, kMostTiles = 1'000'000;

  std::size_t max_particles = 16'000'000;
  /// Tiles of 32 x 32 lattice nodes that particles reach. One that little of the isoline runs
  /// through costs about 10 kB of memory; each of its cells that it does run through 1 kB more.
  std::size_t max_tiles = 131'072;
};

/// INVALID_ARGUMENT with reason OUT_OF_RANGE if a limit is beyond the most that it may be.
absl::Status Validate(const FrameLimits& limits);

}  // namespace partiemc
