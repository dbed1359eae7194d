// Three-component recordings of 2D simulations: which plane they lie in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/base/particle_rows.h"
#include "client/input/sequence.h"

namespace partiemc::client::input {

/// Turns the rows of a sequence's frames into frames of the plane that its first particles lie in,
/// or leaves them in space.
class PlaneProjection {
 public:
  explicit PlaneProjection(bool in_space = false) : in_space_(in_space) {}

  /// Fills everything of `frame` but `index`. What a reader should know is appended to `notices`,
  /// each once. Errors: kFailedPrecondition if the particles are 3D or leave the plane, or if they
  /// should be 3D and have two coordinates.
  absl::Status Project(const ParticleRows& rows, RecordedFrame& frame,
                       std::vector<std::string>& notices);

 private:
  struct Plane {
    std::size_t dropped_axis;
    double offset;  // Of the plane on the dropped axis.
  };

  absl::Status Decide(const ParticleRows& rows, std::vector<std::string>& notices);
  absl::Status CheckStaysInPlane(const ParticleRows& rows);
  // The axes that a frame keeps, of which there are two or three.
  using Axes = std::span<const std::size_t>;
  absl::StatusOr<Axes> AxesFor(const ParticleRows& rows, std::vector<std::string>& notices);
  void CopyOptionalArrays(const ParticleRows& rows, Axes axes, RecordedFrame& frame,
                          std::vector<std::string>& notices);

  bool in_space_;
  std::optional<Plane> plane_;
  double largest_extent_ = 0;  // Of the frames so far: what the tolerance is relative to.
  bool told_volumes_ = false;
  bool told_velocities_ = false;
  bool told_ids_ = false;
  bool told_plane_of_two_ = false;
  std::vector<std::uint64_t> sorted_ids_;
};

}  // namespace partiemc::client::input
