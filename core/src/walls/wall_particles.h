// Divides a frame into fluid and wall particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "frame/particle_copy.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"

namespace partiemc {

class WallParticles {
 public:
  /// Divides a frame by ReconstructionParameters::wall_phases. Wall particles keep only positions
  /// and volumes. Errors: INVALID_ARGUMENT if a frame with particles lacks the attribute of the
  /// phases, or if this is not one whole number per particle. Requires: CheckFrame has passed the
  /// frame. Cost: linear.
  absl::Status Take(const Frame& frame, const ReconstructionParameters& parameters);

  /// An upper bound of the memory for a frame.
  static std::uint64_t BytesFor(const Frame& frame);

  /// Views of this object. The fluid has the attribute of the phases if there are sections, the
  /// walls have no attributes.
  const Frame& fluid() const { return fluid_.frame; }
  /// By particle of the fluid, or of the walls: its number in the given frame.
  std::span<const std::uint32_t> fluid_sources() const { return fluid_.sources; }
  std::span<const std::uint32_t> wall_sources() const { return walls_.sources; }
  const Frame& walls() const { return walls_.frame; }

 private:
  struct Part {
    std::vector<std::uint32_t> sources;
    std::vector<double> positions;
    std::vector<float> velocities;
    ParticleCopy copy;
    Frame frame;

    void Take(const Frame& frame);
  };

  Part fluid_, walls_;
  std::vector<Attribute> attributes_;
};

}  // namespace partiemc
