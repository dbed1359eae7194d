#include "partiemc/reconstructor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/bits.h"
#include "base/cancellation.h"
#include "bins/resolution.h"
#include "bins/spacing_doubt.h"
#include "frame/spacing.h"
#include "partiemc/status.h"
#include "vertices/intersections.h"
#include "workspace.h"
#include "workspace_bytes.h"

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
    ThrowIfCancelled();
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

// Volumes of a frame are doubtful where more than half of them are this many times the squared
// spacing, or less than its inverse: discs of a diameter h are at 0.79, hexagonal packing at 0.87.
constexpr double kDoubtfulVolumeRatio = 2;

// Spacing and lattice of a frame, in world units.
struct Lengths {
  double spacing, cell_size;
  bool is_provisional;  // No spacing is given, and no frame so far has agreed on one.
};

// The side of the square of the median volume.
double SpacingOfVolumes(std::span<const float> volumes, std::vector<double>& scratch) {
  scratch.assign(volumes.begin(), volumes.end());
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return std::sqrt(*middle);
}

// The spacing that a frame tells by itself; nothing where it tells none. What its particles do not
// agree on is only a guess, for which volumes are better than distances.
absl::StatusOr<std::optional<SpacingEstimate>> OwnSpacing(const Frame& frame, Plane plane,
                                                          SpacingScratch& scratch) {
  std::optional<SpacingEstimate> own = EstimateSpacing(frame, plane, scratch);
  if ((!own || !own->is_agreed) && !frame.volumes.empty()) {
    own = SpacingEstimate{SpacingOfVolumes(frame.volumes, scratch.weights), false};
  }
  if (!own || (own->spacing >= kMinSpacing && own->spacing <= kMaxSpacing)) return own;
  if (!own->is_agreed) return std::nullopt;
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(kReasonOutOfRange), "positions",
                         absl::StrCat("spacing of ", ShortestNumber(own->spacing)),
                         "must have a spacing in [1e-60, 1e60]"});
}

// Nothing while there is not even a guess.
absl::StatusOr<std::optional<Lengths>> DecideLengths(const ReconstructionParameters& parameters,
                                                     const Frame& frame, const State& state,
                                                     SpacingScratch& scratch) {
  std::optional<double> spacing = parameters.spacing;
  if (!spacing && parameters.spacing_rule == SpacingRule::kFirstFrame) spacing = state.spacing;
  bool is_provisional = false;
  if (!spacing) {
    const auto own = OwnSpacing(frame, parameters.plane, scratch);
    if (!own.ok()) return own.status();
    const bool is_agreed = *own && (*own)->is_agreed;
    is_provisional = !is_agreed && !state.spacing;
    if (is_agreed || (is_provisional && *own)) {
      spacing = (*own)->spacing;
    } else {
      spacing = state.spacing;
    }
  }
  if (!spacing) return std::nullopt;
  const double cell_size = state.cell_size.value_or(parameters.cell_size * *spacing);
  return Lengths{
      std::clamp(*spacing, kMinSpacingInCells * cell_size, kMaxSpacingInCells * cell_size),
      cell_size, is_provisional};
}

// The smallest volume of the frame, h^2 where particles have none. Adds the doubt that they give
// reason for.
absl::StatusOr<double> LightestVolume(const Frame& frame, double spacing, Doubts& doubts) {
  const double usual = spacing * spacing;
  if (frame.volumes.empty()) return usual;
  double lightest = std::numeric_limits<double>::infinity();
  std::size_t large = 0, small = 0;
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
    large += volume > kDoubtfulVolumeRatio * usual ? 1 : 0;
    small += kDoubtfulVolumeRatio * volume < usual ? 1 : 0;
  }
  if (2 * std::max(large, small) > frame.volumes.size()) {
    doubts.Add(Doubt::kVolumesContradictSpacing);
  }
  return lightest;
}

// Adds the doubts that the bins give reason for. Errors: see CheckResolution; what is measured by a
// guess is no error.
absl::Status JudgeLengths(const Frame& frame, Plane plane, const Lengths& lengths,
                          const Scale& scale, const ParticleBins& bins, Doubts& doubts) {
  absl::Status fine =
      CheckResolution(frame, plane, bins.tiles, lengths.cell_size, lengths.spacing, doubts);
  if (lengths.is_provisional) {
    doubts.Add(Doubt::kSpacingProvisional);
    return absl::OkStatus();
  }
  if (ContradictsSpacing(bins, scale)) doubts.Add(Doubt::kSpacingContradicted);
  return fine;
}

// Nothing is remembered of a frame whose lengths are a guess, hence no identity either.
void Untrack(Rings& rings) {
  for (RingMeasures& measures : rings.measures) measures.identity = 0;
  rings.parents.clear();
  rings.parent_offsets.assign(1, 0);
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

// RESOURCE_EXHAUSTED if `guard` has no room for a frame of this size.
absl::Status Reserve(MemoryGuard* guard, const FrameSize& size) {
  const std::uint64_t bytes = WorkspaceBytes(size);
  if (guard == nullptr || guard->Reserve(bytes)) return absl::OkStatus();
  return ViolationError(
      absl::StatusCode::kResourceExhausted,
      {std::string(kReasonOutOfMemory), "positions",
       absl::StrCat(size.tiles, " tiles of 32 x 32 cells"),
       absl::StrCat("must not take ", (bytes >> 20) + 1,
                    " MiB, which there is no room for: reach fewer tiles, or try again later")});
}

// As soon as its segments are known.
FrameSize SizeOf(const ReconstructionParameters& parameters, const Frame& frame,
                 const Workspace::Buffers& b) {
  FrameSize size{.particles = frame.ParticleCount(),
                 .tiles = b.bins.tiles.size(),
                 .segments = b.topology.segments.size()};
  if (parameters.fill != Fill::kGrid) return size;
  for (const BitRows& rows : b.crossings.interior) {
    for (const std::uint32_t row : rows) size.grid_cells += CountBits(row);
  }
  return size;
}

// Stages 2 to 4: everything that follows from the particles' tiles without a vertex.
void Trace(const ReconstructionParameters& parameters, const Scale& scale, StageObserver* observer,
           Workspace::Buffers& b) {
  {
    const StageScope scope(observer, Stage::kField);
    SampleField(b.bins, scale, b.level_set);
  }
  {
    const StageScope scope(observer, Stage::kCrossings);
    FindCrossings(b.bins.tiles, b.level_set, b.crossings);
  }
  const StageScope scope(observer, Stage::kRings);
  TraceRings(b.bins, b.level_set, scale, parameters, b.crossings, b.ring_scratch, b.topology);
}

// Stages 5 to 7.
void Outline(const ReconstructionParameters& parameters, const Frame& frame, const Scale& scale,
             const State& previous, StageObserver* observer, Workspace::Buffers& b,
             Result& result) {
  const bool farthest = parameters.placement == Placement::kFarthestParticle;
  {
    const StageScope scope(observer, Stage::kNormals);
    b.sampler.Build(b.bins, b.crossings, scale, WanderOf(parameters.placement, scale), farthest);
    EstimateNormals(b.bins, b.crossings, b.topology, b.sampler, parameters, previous.normals,
                    b.normal_scratch, b.planes, b.next_normals);
  }
  {
    const StageScope scope(observer, Stage::kVertices);
    b.next_area_offset = previous.area_offset;
    PlaceVertices({frame, b.bins, b.level_set, b.crossings, b.topology, b.sampler, b.planes,
                   parameters, scale},
                  b.next_area_offset, b.placed, result.rings);
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
  BuildMesh({b.bins.tiles, b.crossings, b.ring_scratch, b.topology, b.planes, b.placed,
             result.rings, parameters, scale},
            b.mesh_scratch, result.mesh, result.statistics);
}

// Stages 2 to 7: everything after the particles have found their tiles.
absl::Status Contour(const ReconstructionParameters& parameters, const Frame& frame,
                     const Scale& scale, const State& previous, const FrameControl& control,
                     Workspace::Buffers& b, Result& result) {
  Trace(parameters, scale, control.observer, b);
  if (absl::Status status = Reserve(control.memory, SizeOf(parameters, frame, b)); !status.ok()) {
    return status;
  }
  for (;;) {
    Outline(parameters, frame, scale, previous, control.observer, b, result);
    // No component is ever tangled (repair.h). Were that wrong, it would cost the frame that
    // component, not everything.
    const std::vector<std::uint32_t>& tangled =
        b.placed.repair.tangled.empty() ? b.mesh_scratch.tangled : b.placed.repair.tangled;
    if (tangled.empty()) return absl::OkStatus();
    DropComponents(b.bins, tangled, b.crossings, b.ring_scratch, b.topology);
  }
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
                                        Result& result, const FrameControl& control) const {
  const CancellationScope scope(control.cancelled);
  result.Clear();
  absl::Status status;
  try {
    status = ReconstructOrThrow(frame, state, workspace.buffers(), result, control);
  } catch (...) {
    // Wherever it was left, there are half-made buffers.
    workspace = Workspace();
    result.Clear();
    try {
      throw;
    } catch (const Cancelled&) {
      return absl::CancelledError("the frame was cancelled");
    }
  }
  if (!status.ok()) result.Clear();
  return status;
}

absl::Status Reconstructor::ReconstructOrThrow(const Frame& frame, State& state,
                                               Workspace::Buffers& buffers, Result& result,
                                               const FrameControl& control) const {
  std::optional<Lengths> lengths;
  Scale scale;
  Doubts doubts;
  {
    const StageScope scope(control.observer, Stage::kBins);
    if (absl::Status status = CheckFrame(frame, parameters_.plane, limits_, buffers.distinct_ids);
        !status.ok()) {
      return status;
    }
    auto decided = DecideLengths(parameters_, frame, state, buffers.spacing);
    if (!decided.ok()) return decided.status();
    lengths = *decided;
    if (!lengths) {
      result.statistics.particles = frame.ParticleCount();
      if (frame.ParticleCount() > 0) result.statistics.doubts.Add(Doubt::kSpacingProvisional);
      return absl::OkStatus();
    }
    const auto lightest = LightestVolume(frame, lengths->spacing, doubts);
    if (!lightest.ok()) return lightest.status();
    scale = MakeScale(parameters_, lengths->spacing, lengths->cell_size, *lightest);
    if (absl::Status status = BinParticles(frame, parameters_.plane, scale, limits_, buffers.bins);
        !status.ok()) {
      return status;
    }
    if (absl::Status status =
            JudgeLengths(frame, parameters_.plane, *lengths, scale, buffers.bins, doubts);
        !status.ok()) {
      return status;
    }
  }
  if (absl::Status status = Reserve(
          control.memory, {.particles = frame.ParticleCount(), .tiles = buffers.bins.tiles.size()});
      !status.ok()) {
    return status;
  }
  if (absl::Status status = Contour(parameters_, frame, scale, state, control, buffers, result);
      !status.ok()) {
    return status;
  }
  result.statistics.particles = frame.ParticleCount();
  Summarise(buffers, *lengths, result);
  result.statistics.doubts = doubts;
  if (lengths->is_provisional) {
    Untrack(result.rings);
    return absl::OkStatus();
  }
  state.cell_size = lengths->cell_size;
  state.spacing = lengths->spacing;
  state.area_offset = buffers.next_area_offset;
  std::swap(state.normals, buffers.next_normals);
  std::swap(state.history, buffers.next_history);
  return absl::OkStatus();
}

}  // namespace partiemc
