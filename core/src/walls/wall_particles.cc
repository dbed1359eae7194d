#include "walls/wall_particles.h"

#include <algorithm>
#include <cstddef>
#include <span>

#include "frame/frame_view.h"

namespace partiemc {

void WallParticles::Part::Take(const Frame& from) {
  const auto components = static_cast<std::size_t>(from.components);
  positions.clear();
  velocities.clear();
  std::visit(
      [&](auto all) {
        for (const std::uint32_t k : sources) {
          const auto of = all.subspan(k * components, components);
          positions.insert(positions.end(), of.begin(), of.end());
        }
      },
      from.positions);
  for (const std::uint32_t k : sources) {
    if (from.velocities.empty()) break;
    const auto of = from.velocities.subspan(k * components, components);
    velocities.insert(velocities.end(), of.begin(), of.end());
  }
  copy.Take(from, sources);
  frame = {.positions = std::span<const double>(positions),
           .components = from.components,
           .velocities = velocities,
           .box = from.box};
  copy.View(frame);
}

std::uint64_t WallParticles::BytesFor(const Frame& frame) {
  std::uint64_t each = sizeof(std::uint32_t) + sizeof(double) * frame.components;
  if (!frame.volumes.empty()) each += sizeof(float);
  if (!frame.ids.empty()) each += sizeof(std::uint64_t);
  if (!frame.velocities.empty()) each += sizeof(float) * frame.components;
  for (const Attribute& attribute : frame.attributes) each += sizeof(float) * attribute.components;
  return 2 * each * frame.ParticleCount();  // Vectors grow by doubling.
}

absl::Status WallParticles::Take(const Frame& frame, const ReconstructionParameters& parameters) {
  std::span<const float> phases;
  absl::Status status = TakePhaseValues(frame, parameters.phase_attribute, phases, attributes_);
  if (!status.ok()) return status;
  fluid_.sources.clear();
  walls_.sources.clear();
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const bool is_wall = std::ranges::any_of(parameters.wall_phases, [&](std::int32_t phase) {
      return static_cast<float>(phase) == phases[k];
    });
    (is_wall ? walls_ : fluid_).sources.push_back(static_cast<std::uint32_t>(k));
  }
  Frame others = frame;
  // The phases divide the fluid, too.
  if (parameters.sections.empty()) others.attributes = attributes_;
  fluid_.Take(others);
  others.attributes = {};
  others.ids = {};
  others.velocities = {};
  others.box.reset();  // The outline of walls does not need it: walls/wall_copies.h adds images.
  walls_.Take(others);
  return absl::OkStatus();
}

}  // namespace partiemc
