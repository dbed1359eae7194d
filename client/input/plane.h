// Drops the constant coordinate of a 2D simulation whose recording has three coordinates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/base/particle_rows.h"
#include "client/input/sequence.h"

namespace partiemc::client::input {

/// Converts the rows of each frame of a sequence to a RecordedFrame. In 2D, drops the coordinate
/// that is constant in the first frame with particles. With `in_space`, keeps all coordinates.
class PlaneProjection {
 public:
  /// `keeps_volumes`: volumes that are not positive and finite stay in the frame.
  explicit PlaneProjection(bool in_space = false, bool keeps_volumes = false)
      : in_space_(in_space), keeps_volumes_(keeps_volumes) {}

  /// Fills every field of `frame` except `index`. Appends notices for the user, each once.
  /// Errors: kFailedPrecondition if the particles are 3D or leave the plane, or, with `in_space`,
  /// if they have two coordinates.
  absl::Status Project(const ParticleRows& rows, RecordedFrame& frame,
                       std::vector<std::string>& notices);

  /// The notices of ignored arrays.
  const std::vector<std::string>& losses() const { return losses_; }

 private:
  struct Plane {
    std::size_t dropped_axis;
    double offset;  // Position of the plane on the dropped axis.
  };

  absl::Status Decide(const ParticleRows& rows, std::vector<std::string>& notices);
  absl::Status CheckStaysInPlane(const ParticleRows& rows);
  // The two or three axes that a frame keeps.
  using Axes = std::span<const std::size_t>;
  absl::StatusOr<Axes> AxesFor(const ParticleRows& rows, std::vector<std::string>& notices);
  void CopyOptionalArrays(const ParticleRows& rows, Axes axes, RecordedFrame& frame,
                          std::vector<std::string>& notices);

  // Adds the notice of an ignored array, once per array.
  void Ignore(bool& told, const ParticleRows& rows, std::string_view what,
              std::vector<std::string>& notices);

  bool in_space_, keeps_volumes_;
  std::vector<std::string> losses_;
  std::optional<Plane> plane_;
  double largest_extent_ = 0;  // Largest extent of the frames so far; scale of the tolerance.
  bool told_volumes_ = false;
  bool told_velocities_ = false;
  bool told_ids_ = false;
  bool told_plane_of_two_ = false;
  std::vector<std::uint64_t> sorted_ids_;
};

}  // namespace partiemc::client::input
