#include "frame_walls.h"

#include <utility>

#include "bins/bins.h"
#include "bins/resolution.h"
#include "frame/in_stage.h"
#include "frame/scale.h"
#include "frame_lengths.h"
#include "partiemc/status.h"
#include "walls/wall_copies.h"
#include "walls/wall_corners.h"

namespace partiemc {
namespace {

// In kernel radii of the largest particle: images of wall particles reach this far beyond the
// particles of the fluid. The outline of a wall ends there, so far away that the end has no effect.
constexpr double kWallMargin = 6;
// Images of obstacles have no ends.
constexpr double kObstacleMargin = 2;

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
  InStage(input.observer, Stage::kField, [&] {
    SharpenCorners(input.prepared.lengths->spacing, b.wall_corners, b.wall_result.rings);
  });
  return absl::OkStatus();
}

// The walls in a periodic box.
absl::Status FindImages(const FrameWallsInput& input, FrameMemory& memory, Workspace::Buffers& b,
                        FrameWalls& walls) {
  const ReconstructionParameters& parameters = input.parameters;
  // Without lengths there is no outline.
  const double radius =
      parameters.kernel_radius * (input.prepared.lengths ? input.prepared.lengths->spacing : 0);
  const auto range = [&](double radii) {
    return RangeAround(input.fluid, parameters.plane, radii * radius);
  };
  absl::Status status = b.wall_copies.TakeObstacles(parameters.walls, range(kObstacleMargin));
  walls.fixed = b.wall_copies.walls();
  if (!status.ok() || input.of_walls == nullptr) return status;
  status = b.wall_copies.TakeParticles(
      b.wall_particles.walls(), parameters.plane, range(kWallMargin), [&](std::uint64_t bytes) {
        return memory.ReserveParticles(bytes, "images of wall particles");
      });
  memory.Done();
  return status.ok() ? OutlineWalls(input, b.wall_copies.particles(), memory, b) : status;
}

}  // namespace

ReconstructionParameters WallParametersOf(const ReconstructionParameters& parameters) {
  ReconstructionParameters of = parameters;
  of.walls.clear();
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
  Doubts of_volumes;
  if (auto lightest = LightestVolume(given, spacing * spacing, of_volumes); !lightest.ok()) {
    return lightest.status();
  }
  status = CheckStep(given, parameters.plane, spacing, prepared.doubts);
  return prepared.lengths->is_provisional ? absl::OkStatus() : status;
}

absl::Status FindFrameWalls(const FrameWallsInput& input, FrameMemory& memory,
                            Workspace::Buffers& b, FrameWalls& walls) {
  walls.fixed = input.parameters.walls;
  absl::Status status;
  if (input.parameters.box) {
    status = FindImages(input, memory, b, walls);
  } else if (input.of_walls != nullptr) {
    status = OutlineWalls(input, b.wall_particles.walls(), memory, b);
  }
  if (input.of_walls != nullptr) walls.of_particles = &b.wall_result.rings;
  return status;
}

}  // namespace partiemc
