#include "partiemc/reconstructor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "intersections.h"
#include "partiemc/status.h"
#include "spacing.h"
#include "workspace.h"

namespace partiemc {
namespace {

// The spacing estimated from a later frame may leave the lattice's by these factors at most, so
// that a kernel always spans a sensible number of cells.
constexpr double kMinSpacingInCells = 0.25;
constexpr double kMaxSpacingInCells = 4;

// Particles of one frame may stand for areas this far from h^2: beyond it a single particle would
// decide the guard of the whole frame, and float sums would lose the others.
constexpr double kMaxVolumeRatio = 1e6;

constexpr double kMinSpacing = 1e-60;
constexpr double kMaxSpacing = 1e60;

class StageScope {
 public:
  StageScope(StageObserver* observer, Stage stage) : observer_(observer), stage_(stage) {
    if (observer_ != nullptr) observer_->StageBegins(stage_);
  }
  ~StageScope() {
    if (observer_ != nullptr) observer_->StageEnds(stage_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageObserver* observer_;
  Stage stage_;
};

// Spacing and lattice of a frame, in world units; nothing while the stream has not seen two
// distinct positions.
struct Lengths {
  double spacing, cell_size;
};

absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch) {
  std::optional<double> spacing = parameters.spacing;
  if (!spacing && parameters.spacing_rule == SpacingRule::kFirstFrame) spacing = state.spacing;
  if (!spacing) {
    spacing = EstimateSpacing(frame, parameters.plane, scratch);
    if (spacing && !(*spacing >= kMinSpacing && *spacing <= kMaxSpacing)) {
      return ViolationError(absl::StatusCode::kInvalidArgument,
                            {std::string(kReasonOutOfRange), "positions",
                             absl::StrCat("spacing of ", ShortestNumber(*spacing)),
                             "must have a spacing in [1e-60, 1e60]"});
    }
    if (!spacing) spacing = state.spacing;
  }
  if (!spacing) return std::nullopt;
  const double cell_size = state.cell_size.value_or(parameters.cell_size * *spacing);
  return Lengths{
      std::clamp(*spacing, kMinSpacingInCells * cell_size, kMaxSpacingInCells * cell_size),
      cell_size};
}

// The smallest volume of the frame, h^2 where particles have none.
absl::StatusOr<double> LightestVolume(const Frame& frame, double spacing) {
  const double usual = spacing * spacing;
  if (frame.volumes.empty()) return usual;
  double lightest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < frame.volumes.size(); ++k) {
    const double volume = frame.volumes[k];
    if (!(volume <= kMaxVolumeRatio * usual && volume >= usual / kMaxVolumeRatio)) {
      return ViolationError(
          absl::StatusCode::kInvalidArgument,
          {std::string(kReasonOutOfRange), absl::StrCat("volumes[", k, "]"), ShortestNumber(volume),
           absl::StrCat("must be within a factor of 1e6 of the squared spacing, ",
                        ShortestNumber(usual))});
    }
    lightest = std::min(lightest, volume);
  }
  return lightest;
}

// How far from active cells a placement asks for the field, in cells: `farthest-particle` at the
// mean of the particles around a cell, `virtual-plane` where Newton steps of its roots end.
double WanderOf(Placement placement, const Scale& scale) {
  switch (placement) {
    case Placement::kFarthestParticle:
      return scale.kernel_radius + 1;
    case Placement::kVirtualPlane:
      return 2;
    case Placement::kMarchingSquares:
    case Placement::kQef:
      break;
  }
  return 0;
}

void Summarise(const Workspace::Buffers& buffers, const Lengths& lengths, Result& result) {
  FrameStatistics& statistics = result.statistics;
  statistics.tiles = buffers.bins.tiles.size();
  statistics.active_cells = buffers.crossings.cells.size();
  statistics.dropped_holes = buffers.topology.dropped_holes;
  statistics.dropped_components = buffers.topology.dropped_components;
  statistics.dropped_spray = buffers.topology.dropped_spray;
  statistics.spacing = lengths.spacing;
  statistics.cell_size = lengths.cell_size;
  for (const RingMeasures& measures : result.rings.measures) {
    statistics.area += measures.area;
    statistics.perimeter += measures.perimeter;
  }
}

// Stages 2 to 7: everything after the particles have found their tiles.
absl::Status Contour(const ReconstructionParameters& parameters, const Frame& frame,
                     const Scale& scale, const State& previous, StageObserver* observer,
                     Workspace::Buffers& b, Result& result) {
  const TileDirectory& tiles = b.bins.tiles;
  {
    const StageScope scope(observer, Stage::kField);
    SampleField(b.bins, scale, b.level_set);
  }
  {
    const StageScope scope(observer, Stage::kCrossings);
    FindCrossings(tiles, b.level_set, b.crossings);
  }
  {
    const StageScope scope(observer, Stage::kRings);
    TraceRings(b.bins, b.level_set, scale, parameters, b.crossings, b.ring_scratch, b.topology);
  }
  const bool farthest = parameters.placement == Placement::kFarthestParticle;
  {
    const StageScope scope(observer, Stage::kNormals);
    b.point_field.Build(b.bins, b.crossings, scale, WanderOf(parameters.placement, scale),
                        farthest);
    EstimateNormals(b.bins, b.crossings, b.topology, b.point_field, parameters, previous.normals,
                    b.normal_scratch, b.planes, b.next_normals);
  }
  {
    const StageScope scope(observer, Stage::kVertices);
    PlaceVertices({frame, b.bins, b.level_set, b.crossings, b.topology, b.point_field, b.planes,
                   parameters, scale},
                  {previous.outline, b.next_outline, b.next_area_offset}, b.placed, result.rings);
    ContinueRings({frame, parameters.plane, b.bins, b.crossings, b.ring_scratch, b.topology,
                   b.placed, scale.cell_size},
                  previous.history, b.identity_scratch, b.next_history, result.rings);
    // The other placements do not cross: Validate checks that claim, the hot path trusts it.
    if (farthest) {
      result.statistics.self_intersections =
          CountTouchingPairs(result.rings.points, result.rings.offsets, b.intersections);
    }
  }
  const StageScope scope(observer, Stage::kMesh);
  return BuildMesh({tiles, b.crossings, b.ring_scratch, b.topology, b.planes, b.placed,
                    result.rings, parameters, scale},
                   b.mesh_scratch, result.mesh, result.statistics);
}

}  // namespace

Workspace::Workspace() : buffers_(std::make_unique<Buffers>()) {}
Workspace::~Workspace() = default;
Workspace::Workspace(Workspace&&) noexcept = default;
Workspace& Workspace::operator=(Workspace&&) noexcept = default;

absl::StatusOr<Reconstructor> Reconstructor::Create(const ReconstructionParameters& parameters,
                                                    const FrameLimits& limits) {
  if (absl::Status status = Validate(parameters); !status.ok()) return status;
  if (absl::Status status = Validate(limits); !status.ok()) return status;
  return Reconstructor(Resolve(parameters), limits);
}

absl::Status Reconstructor::Reconstruct(const Frame& frame, State& state, Workspace& workspace,
                                        Result& result, StageObserver* observer) const {
  Workspace::Buffers& buffers = workspace.buffers();
  result.Clear();
  std::optional<Lengths> lengths;
  Scale scale;
  {
    const StageScope scope(observer, Stage::kBins);
    if (absl::Status status = CheckFrame(frame, parameters_.plane, limits_, buffers.distinct_ids);
        !status.ok()) {
      return status;
    }
    auto decided = DecideLengths(parameters_, frame, state, buffers.spacing);
    if (!decided.ok()) return decided.status();
    lengths = *decided;
    if (!lengths) {
      result.statistics.particles = frame.ParticleCount();
      return absl::OkStatus();
    }
    const auto lightest = LightestVolume(frame, lengths->spacing);
    if (!lightest.ok()) return lightest.status();
    scale = MakeScale(parameters_, lengths->spacing, lengths->cell_size, *lightest);
    if (absl::Status status = BinParticles(frame, parameters_.plane, scale, limits_, buffers.bins);
        !status.ok()) {
      return status;
    }
  }
  buffers.next_area_offset = state.area_offset;
  if (absl::Status status = Contour(parameters_, frame, scale, state, observer, buffers, result);
      !status.ok()) {
    result.Clear();
    return status;
  }
  result.statistics.particles = frame.ParticleCount();
  Summarise(buffers, *lengths, result);
  state.cell_size = lengths->cell_size;
  state.spacing = lengths->spacing;
  state.area_offset = buffers.next_area_offset;
  std::swap(state.normals, buffers.next_normals);
  std::swap(state.history, buffers.next_history);
  std::swap(state.outline, buffers.next_outline);
  return absl::OkStatus();
}

}  // namespace partiemc
