#include "frame_walls.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "bins/bins.h"
#include "bins/resolution.h"
#include "frame/frame_view.h"
#include "frame/in_stage.h"
#include "frame/scale.h"
#include "frame/wall_rules.h"
#include "frame_lengths.h"
#include "partiemc/status.h"
#include "walls/wall_copies.h"
#include "walls/wall_corners.h"

namespace partiemc {
namespace {

// In kernel radii: images of wall particles reach this far beyond the particles of the fluid. The
// outline of a wall ends there, so far away that the end has no effect.
constexpr double kWallMargin = 6;
// Images of obstacles have no ends.
constexpr double kObstacleMargin = 2;

// Replaces the number of a particle in an error about its position by name(number). `count`: of
// particles that have a name. Other errors stay.
absl::Status WithNumber(const absl::Status& status, std::size_t count,
                        absl::FunctionRef<std::uint32_t(std::uint32_t)> name) {
  const std::string prefix = "positions[";
  std::optional<Violation> violation = FindViolation(status);
  if (!violation || !violation->field.starts_with(prefix)) return status;
  const std::size_t end = violation->field.find(']');
  std::uint32_t number = 0;
  const auto digits = std::string_view(violation->field).substr(prefix.size(), end);
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (read.ec != std::errc() || number >= count) return status;
  violation->field = absl::StrCat(prefix, name(number), violation->field.substr(end));
  return ViolationError(status.code(), *std::move(violation));
}

// The outline of wall particles, with sharp corners: b.wall_result.
absl::Status OutlineWalls(const FrameWallsInput& input, const Frame& particles, FrameMemory& memory,
                          Workspace::Buffers& b) {
  b.wall_result.Clear();
  if (!input.prepared.lengths) return absl::OkStatus();
  Prepared of_walls{.lengths = input.prepared.lengths, .doubts = input.prepared.doubts};
  of_walls.lifted.particles = particles.ParticleCount();
  const State unseen;
  absl::Status status = ReconstructOutline({*input.of_walls, input.variant, input.limits, particles,
                                            unseen, input.observer, false, &of_walls},
                                           memory, b, b.wall_state, b.wall_result);
  if (!status.ok()) return status;
  memory.Done();
  // Corners are rounded by the kernels of the wall particles, and by the lattice of the fluid.
  double spacing = input.prepared.lengths->spacing;
  if (input.of_walls->sizes == Sizes::kOwn && !particles.volumes.empty()) {
    spacing = std::max(spacing, SpacingOfSizes(particles.volumes));
  }
  InStage(input.observer, Stage::kField,
          [&] { SharpenCorners(spacing, b.wall_corners, b.wall_result.rings); });
  return absl::OkStatus();
}

// The walls in a periodic box.
absl::Status FindImages(const FrameWallsInput& input, FrameMemory& memory, Workspace::Buffers& b,
                        FrameWalls& walls) {
  const ReconstructionParameters& parameters = input.parameters;
  absl::Status status =
      CheckWallsInBox(parameters.walls, *input.fluid.box, AxesOf(input.fluid, parameters.plane));
  // Without lengths there is no outline.
  if (!status.ok() || !input.prepared.lengths) return status;
  const double radius =
      parameters.kernel_radius * input.prepared.lengths->spacing * input.prepared.largest_size;
  const auto reserve = [&](std::uint64_t bytes) {
    absl::Status reserved = memory.ReserveParticles(bytes, "images of walls");
    memory.Done();
    return reserved;
  };
  status = InStage(input.observer, Stage::kBins, [&] {
    const WallRange range = RangeOf(input.fluid, parameters.plane);
    absl::Status taken = b.wall_copies.TakeObstacles(
        parameters.walls, Widened(range, kObstacleMargin * radius), reserve);
    if (!taken.ok() || input.of_walls == nullptr) return taken;
    return b.wall_copies.TakeParticles(
        {b.wall_particles.walls(), parameters.plane, b.wall_particles.wall_sources()},
        Widened(range, kWallMargin * radius), reserve);
  });
  walls.fixed = b.wall_copies.walls();
  walls.are_obstacles = true;
  if (!status.ok() || input.of_walls == nullptr) return status;
  const auto names = b.wall_copies.names();
  return WithNumber(OutlineWalls(input, b.wall_copies.particles(), memory, b), names.size(),
                    [&](std::uint32_t copy) { return names[copy]; });
}

}  // namespace

ReconstructionParameters WallParametersOf(const ReconstructionParameters& parameters) {
  ReconstructionParameters of = parameters;
  of.walls.clear();
  of.sections.clear();
  of.box.reset();  // Wall particles have images in its place.
  of.fill = Fill::kNone;
  of.min_component_area = 0;
  of.min_component_particles = 0;
  return of;
}

absl::Status TakeWallParticles(const Frame& given, const ReconstructionParameters& parameters,
                               const State& state, FrameMemory& memory, Workspace::Buffers& b,
                               Prepared& prepared) {
  absl::Status status =
      memory.ReserveParticles(WallParticles::BytesFor(given), "particles of fluid and walls");
  if (!status.ok()) return status;
  memory.Done();
  status = b.wall_particles.Take(given, parameters);
  if (!status.ok()) return status;
  const Frame& fluid = b.wall_particles.fluid();
  if (fluid.ParticleCount() == 0 && given.ParticleCount() > 0) {
    prepared.doubts.Add(Doubt::kWallsHideFluid);
  }
  prepared.lifted = {.frame = fluid, .particles = fluid.ParticleCount()};
  const auto lengths = DecideLengths(parameters, fluid, state, b.spacing);
  if (!lengths.ok()) return lengths.status();
  prepared.lengths = *lengths;
  if (!prepared.lengths) return absl::OkStatus();
  const double spacing = prepared.lengths->spacing;
  // Checks the frame as given, so that errors name the caller's numbers of particles.
  Scale scale;
  scale.cell_size = prepared.lengths->cell_size;
  status = CheckDistances(given, parameters.plane, scale);
  if (!status.ok()) return status;
  double smallest = 1;
  if (parameters.sizes == Sizes::kOwn) {
    const auto sizes = RangeOfSizes(given, parameters, *prepared.lengths);
    if (!sizes.ok()) return sizes.status();
    prepared.largest_size = sizes->Reach();
    smallest = sizes->smallest;
  } else {
    Doubts of_volumes;
    const auto lightest = LightestVolume(given, spacing * spacing, of_volumes);
    if (!lightest.ok()) return lightest.status();
  }
  status = CheckStep(given, parameters.plane, spacing * smallest, prepared.doubts);
  return prepared.lengths->is_provisional ? absl::OkStatus() : status;
}

absl::Status FindFrameWalls(const FrameWallsInput& input, FrameMemory& memory,
                            Workspace::Buffers& b, FrameWalls& walls) {
  walls.fixed = input.parameters.walls;
  b.wall_result.Clear();
  absl::Status status;
  if (input.parameters.box) {
    status = FindImages(input, memory, b, walls);
  } else if (input.of_walls != nullptr) {
    status = OutlineWalls(input, b.wall_particles.walls(), memory, b);
  }
  if (input.of_walls != nullptr) walls.of_particles = &b.wall_result.rings;
  return status;
}

absl::Status NamingGivenParticle(const absl::Status& status, const Prepared& prepared,
                                 std::span<const std::uint32_t> fluid_sources) {
  const LiftedFrame& lifted = prepared.lifted;
  return WithNumber(status, lifted.frame.ParticleCount(), [&](std::uint32_t particle) {
    return fluid_sources[lifted.OriginalOf(particle)];
  });
}

}  // namespace partiemc
