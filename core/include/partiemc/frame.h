// The particles of one frame, as views of the caller's arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// A quantity of the particles, such as pressure.
struct Attribute {
  std::string_view name;          ///< Unique in the frame; 1 to 64 bytes of printable ASCII.
  int components = 1;             ///< 1 to 3.
  std::span<const float> values;  ///< `components` per particle, interleaved. Finite.
};

/// Most components that all attributes of a frame may have together.
inline constexpr std::size_t kMostAttributeValues = 32;

/// The particles at one time. All arrays have the same order. The arrays must outlive the call.
struct Frame {
  /// Interleaved coordinates in world units, `components` per particle. Finite.
  std::variant<std::span<const float>, std::span<const double>> positions;

  /// 2 (x, y) or 3 (x, y, z). Slices and surfaces require 3. Otherwise, with 3 all particles lie in
  /// one plane parallel to ReconstructionParameters::plane.
  int components = 2;

  /// Area of each particle in world units squared; for slices and surfaces its volume in world
  /// units cubed. Positive and finite. If empty, each particle counts as h^2, for slices and
  /// surfaces as h^3, with the spacing h. Sizes::kOwn requires volumes.
  std::span<const float> volumes = {};

  /// Distinct numbers that particles keep from frame to frame. Empty if the particles have no
  /// numbers. Ids influence only identities and parents (core/IDENTITIES.md), and the filtered
  /// positions if ReconstructionParameters::noise_filter is set, which requires ids.
  std::span<const std::uint64_t> ids = {};

  /// Interleaved like `positions`, in world units per unit of `time`. Finite. Empty if the frame
  /// has no velocities. Velocities influence only identities and parents.
  std::span<const float> velocities = {};

  /// Quantities to interpolate to the vertices (Result::attributes, Surface::attributes), and the
  /// phase of each particle (ReconstructionParameters::phase_attribute). Interpolated quantities do
  /// not change the geometry, except the mesh of Fill::kGreedy
  /// (ReconstructionParameters::attribute_tolerance) and the faces of a surface at walls and at a
  /// periodic box, which get inner points (Surface::cuts).
  std::span<const Attribute> attributes = {};

  /// Simulation time. Velocities are used only if the time increases from frame to frame.
  double time = 0;

  /// The periodic box of this frame, instead of ReconstructionParameters::box. Requires a box of
  /// the stream with the same periodic axes; lengths have the same limits. `wraps` is ignored: the
  /// stream's applies. Identities and the noise filter expect that particles move with the box
  /// (core/PERIODIC.md, "Boxes that change").
  std::optional<PeriodicBox> box = std::nullopt;

  std::size_t ParticleCount() const {
    return std::visit([](auto view) { return view.size(); }, positions) /
           static_cast<std::size_t>(components);
  }
};

/// The name that selects Frame::velocities as an attribute.
inline constexpr std::string_view kVelocityAttribute = "velocity";

/// Sets `chosen` to views of the attributes with these names, in the order of the names.
/// kVelocityAttribute selects Frame::velocities if the frame has them. In a frame without
/// particles, an unknown name selects an attribute with one component and no values.
/// Errors: INVALID_ARGUMENT with reason NO_SUCH_ATTRIBUTE; `chosen` is then incomplete.
absl::Status ChooseAttributes(const Frame& frame, std::span<const std::string> names,
                              std::vector<Attribute>& chosen);

/// Limits of a frame. A frame with too many particles is refused before memory is allocated for it,
/// a frame with too many tiles before memory is allocated for tiles.
struct FrameLimits {
  /// Upper bounds of the limits, so that all counts fit into 32 bits.
  static constexpr std::size_t kMostParticles = 1'000'000'000, kMostTiles = 1'000'000;

  std::size_t max_particles = 16'000'000;
  /// A tile is a square of 32 x 32 lattice nodes; tiles exist only near particles. A tile costs
  /// about 10 kB of memory, and each of its cells that the outline crosses 1 kB more. For surfaces,
  /// the limit applies to bricks of 8 x 8 x 8 nodes.
  std::size_t max_tiles = 131'072;
};

/// Errors: INVALID_ARGUMENT with reason OUT_OF_RANGE if a limit exceeds its upper bound.
absl::Status Validate(const FrameLimits& limits);

}  // namespace partiemc
