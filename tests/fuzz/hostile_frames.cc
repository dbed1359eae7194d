#include "fuzz/hostile_frames.h"

#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "partiemc/partiemc.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kMostParticles = 96;

// A difficult coordinate near `origin`: on nodes and halfway between them (ties), slightly beside
// them, anywhere, or with arbitrary bits. `reach`: see HostileFrame.
double HostileCoordinate(Choices& choices, double origin, double spacing, int reach = 0) {
  const auto kind = choices.Take<std::uint8_t>();
  int step = choices.Take<std::int8_t>();
  if (reach > 0) step %= reach;
  const double place = origin + spacing * step;
  switch (kind % 16) {
    case 0:
      return origin + spacing * 0.5 * step;
    case 1:
      return std::nextafter(place, std::numeric_limits<double>::infinity());
    case 2:
      return origin + spacing * 0x1p-17 * choices.Take<std::int16_t>();
    case 3:
      return place + spacing * choices.Take<std::int16_t>() * 0x1p-15;
    case 4:
      return kind == 4 ? choices.Take<double>() : place;
    case 5:
      return kind == 5 ? origin + spacing * choices.Take<float>() : place;
    default:
      return place;
  }
}

double HostileOrigin(Choices& choices) {
  constexpr double kOrigins[] = {0, 0, 0, 0, 0.5, -3.25, 1e6, -1e9, 16777216.5, 2e9, 1e15, -1e300};
  return kOrigins[choices.Below(std::size(kOrigins))];
}

double HostileRatio(Choices& choices, double low, double usual, double high) {
  switch (choices.Below(6)) {
    case 0:
      return low;
    case 1:
      return high;
    case 2:
      return low + (high - low) * choices.Take<std::uint16_t>() / 65535.0;
    case 3:
      return choices.Below(32) == 7 ? choices.Take<double>() : usual;
    default:
      return usual;
  }
}

// A line, a rectangle in either direction, or points in any order, near the particles or far from
// them. The lines of the first two are often lines of the lattice.
Wall HostileWall(Choices& choices, double spacing) {
  const auto coordinate = [&] { return HostileCoordinate(choices, 0, spacing, 32); };
  const auto kind = choices.Take<std::uint8_t>();
  Wall wall;
  if (kind % 4 == 3) {
    const std::size_t count = choices.Below(13);
    for (std::size_t k = 0; k < count; ++k) wall.points.push_back(coordinate());
    return wall;
  }
  const double x0 = coordinate(), y0 = coordinate(), x1 = coordinate(), y1 = coordinate();
  if (kind % 4 == 0) return {.points = {x0, y0, x1, y1}};
  if (kind % 8 == 1)
    return {.points = {x0 - 1e20, y0, x0 + 1e20, y0, x0 + 1e20, y1, x0 - 1e20, y1}};
  return {.points = {x0, y0, x1, y0, x1, y1, x0, y1}};
}

// Most walls of a periodic box are refused. This one is more often an endless line along the
// periodic axis or a clockwise polygon.
Wall InBox(Wall wall, const PeriodicBox& box) {
  std::vector<double>& points = wall.points;
  if (points.size() == 4) {
    if (box.axes[0]) points[3] = points[1];
    if (!box.axes[0] && box.axes[1]) points[2] = points[0];
  } else if (points.size() == 8 && (points[4] > points[0]) == (points[5] > points[1])) {
    std::swap(points[2], points[6]);
    std::swap(points[3], points[7]);
  }
  return wall;
}

// The id of particle `k`: usually its number, so that successive frames share particles; otherwise
// any byte, which may repeat an id or reuse another particle's.
std::uint64_t HostileId(Choices& choices, std::size_t k) {
  const auto byte = choices.Take<std::uint8_t>();
  return byte % 16 == 15 ? byte : k;
}

void RequireGuarantees(const ReconstructionParameters& parameters, const Result& result) {
  if (!KeepsGuarantees(parameters.placement)) return;
  RequireOk(Validate(result, parameters.fill),
            absl::StrCat("every guarantee holds (", std::string(Name(parameters.placement)), ", ",
                         std::string(Name(parameters.fill)), ")"));
  for (const Result& section : result.sections) {
    RequireOk(Validate(section, parameters.fill), "every guarantee holds for each phase");
  }
  Require(result.statistics.self_intersections == 0, "no crossings are told");
  Require(result.statistics.folded_triangles == 0, "no folds are told");
}

void RequireNoTrace(const absl::Status& status, const Result& result, const State& before,
                    const State& after) {
  Require(status.code() == absl::StatusCode::kInvalidArgument ||
              status.code() == absl::StatusCode::kOutOfRange ||
              status.code() == absl::StatusCode::kResourceExhausted,
          absl::StrCat("a frame is refused for what it is: ", status.ToString()));
  RequireViolation(status);
  Result empty;
  empty.sections.resize(result.sections.size());
  Require(result == empty || result == Result{}, "the result of a refused frame is empty");
  Require(Serialize(before) == Serialize(after), "a refused frame leaves no trace");
}

}  // namespace

HostileFrame::HostileFrame(Choices& choices, double spacing, int reach) {
  const auto shape = choices.Take<std::uint8_t>();
  is_float_ = shape & 1;
  components_ = ((shape & 6) == 2) != (reach > 0) ? 3 : 2;
  const std::size_t count = choices.Below(kMostParticles + 1);
  const double x = HostileOrigin(choices), y = HostileOrigin(choices);
  for (std::size_t k = 0; k < count && !choices.empty(); ++k) {
    doubles_.push_back(HostileCoordinate(choices, x * spacing, spacing, reach));
    doubles_.push_back(HostileCoordinate(choices, y * spacing, spacing, reach));
    if (components_ == 3 && reach > 0) {
      doubles_.push_back(HostileCoordinate(choices, 0, spacing, reach));
    } else if (components_ == 3) {
      doubles_.push_back(shape & 128 ? HostileCoordinate(choices, 0, 1) : 0);
    }
    const double volume = spacing * spacing * (reach > 0 ? spacing : 1);
    if (shape & 8) volumes_.push_back(static_cast<float>(volume));
    if (shape & 16) ids_.push_back(HostileId(choices, k));
    if (shape & 32) {
      for (int axis = 0; axis < components_; ++axis) velocities_.push_back(choices.Take<float>());
    }
  }
  if (!volumes_.empty() && choices.Flip())
    volumes_[choices.Below(volumes_.size())] = choices.Take<float>();
  if ((shape & 64) && !doubles_.empty()) doubles_.pop_back();  // An incomplete particle.
  if (choices.Below(16) == 5 && !ids_.empty()) ids_.pop_back();
  time_ = choices.Flip() ? choices.Take<std::int8_t>() : choices.Take<double>();
  if (const auto pattern = choices.Take<std::uint8_t>(); pattern % 2 == 1) {
    // Stripes, single particles of another phase, or nearly one phase.
    for (std::size_t k = 0; k < doubles_.size() / components_; ++k) {
      phases_.push_back(static_cast<float>(k * pattern / 16 % 4));
    }
    if (!phases_.empty() && choices.Below(8) == 1) {
      phases_[choices.Below(phases_.size())] = choices.Take<float>();
    }
    attributes_.push_back({.name = "phase", .values = phases_});
  }
  if (!is_float_) return;
  for (const double value : doubles_) {
    // Outside of float's range the conversion is undefined.
    const bool fits = std::abs(value) <= std::numeric_limits<float>::max();
    floats_.push_back(fits ? static_cast<float>(value) : std::numeric_limits<float>::infinity());
  }
}

Frame HostileFrame::AsFrame() const {
  Frame frame{.positions = std::span<const double>(doubles_),
              .components = components_,
              .volumes = volumes_,
              .ids = ids_,
              .velocities = velocities_,
              .attributes = attributes_,
              .time = time_};
  if (is_float_) frame.positions = std::span<const float>(floats_);
  return frame;
}

ReconstructionParameters HostileParameters(Choices& choices) {
  ReconstructionParameters parameters;
  parameters.placement = AllPlacements()[choices.Below(AllPlacements().size())];
  parameters.fill = AllFills()[choices.Below(AllFills().size())];
  const auto flags = choices.Take<std::uint8_t>();
  constexpr double kSpacings[] = {1, 0.01, 1e-9, 1e7, 1e-60, 1e60, 0.0303, 3};
  if (!(flags & 1)) parameters.spacing = kSpacings[choices.Below(8)];
  parameters.spacing_rule = flags & 2 ? SpacingRule::kEveryFrame : SpacingRule::kFirstFrame;
  parameters.normal_memory = !(flags & 4);
  if (flags & 8) parameters.clean = (flags & 16) != 0;
  parameters.plane = flags & 32 ? Plane::kYz : Plane::kXy;
  if (flags & 64) parameters.min_component_area = choices.Take<std::uint8_t>();
  if (flags & 128) parameters.min_component_particles = choices.Take<std::uint8_t>();
  parameters.kernel_radius = HostileRatio(choices, 1.5, 3, 8);
  parameters.cell_size = HostileRatio(choices, 0.25, 1, 4);
  if (choices.Below(4) == 1) {
    parameters.reference_radius = HostileRatio(choices, 0.01, 1, 7.9);
  }
  if (choices.Below(4) == 1) parameters.surface_offset = HostileRatio(choices, -1, 0, 1);
  if (choices.Below(4) == 1) {
    const double unit = parameters.spacing.value_or(1);
    parameters.box.emplace();
    for (auto& axis : parameters.box->axes) {
      const auto size = choices.Take<std::uint8_t>();
      if (size > 0) axis = PeriodicAxis{unit * static_cast<double>(choices.Below(9)), unit * size};
    }
    if (choices.Below(4) != 1) parameters.box->axes[2].reset();
    parameters.box->wraps = choices.Below(4) == 1;
  }
  if (choices.Below(4) == 1) parameters.noise_filter = HostileRatio(choices, 0, .5, 1);
  if (!parameters.noise_filter && choices.Below(4) == 1) {
    parameters.sizes = Sizes::kOwn;
    if (choices.Below(2) == 1) parameters.boundary = Boundary::kGrains;
  }
  const bool may_have_walls =
      parameters.boundary == Boundary::kBulk && parameters.placement == Placement::kVirtualPlane;
  const bool may_have_phases =
      parameters.boundary == Boundary::kBulk && parameters.placement == Placement::kVirtualPlane;
  if (may_have_phases && choices.Below(2) == 1) {
    const auto last = static_cast<std::int32_t>(choices.Below(3));
    for (std::int32_t phase = 0; phase <= last; ++phase) {
      parameters.sections.push_back({.phase = phase});
    }
  }
  if (may_have_walls && choices.Below(2) == 1) {
    const std::size_t count = 1 + choices.Below(3);
    for (std::size_t k = 0; k < count; ++k) {
      Wall wall = HostileWall(choices, parameters.spacing.value_or(1));
      if (parameters.box && k % 4 != 3) wall = InBox(std::move(wall), *parameters.box);
      parameters.walls.push_back(std::move(wall));
    }
  }
  if (may_have_walls && !parameters.noise_filter && choices.Below(2) == 1) {
    for (std::int32_t phase = static_cast<std::int32_t>(choices.Below(3)); phase >= 0; --phase) {
      parameters.wall_phases.push_back(phase);
    }
  }
  return parameters;
}

namespace {

// Each third frame of a stream with a box has a box of its own. No choice, so that the corpus keeps
// its meaning.
Frame WithBox(Frame frame, const std::optional<PeriodicBox>& of_stream, int k) {
  if (!of_stream || k % 3 != 1) return frame;
  frame.box = of_stream;
  for (auto& axis : frame.box->axes) {
    if (axis) axis = PeriodicAxis{axis->origin - .03 * axis->length, 1.07 * axis->length};
  }
  return frame;
}

}  // namespace

void AttackStream(Choices& choices, const ReconstructionParameters& parameters, State state,
                  int frames) {
  const SingleThread single_thread;
  const auto reconstructor = Reconstructor::Create(parameters, kHostileLimits);
  if (!reconstructor.ok()) {
    RequireViolation(reconstructor.status());
    return;
  }
  static auto* const workspace = new Workspace;  // Its history never changes a result.
  Result result, again;
  for (int k = 0; k < frames; ++k) {
    const HostileFrame hostile(choices, parameters.spacing.value_or(1));
    const Frame frame = WithBox(hostile.AsFrame(), parameters.box, k);
    const State before = state;
    const absl::Status status = reconstructor->Reconstruct(frame, state, *workspace, result);
    if (!status.ok()) {
      RequireNoTrace(status, result, before, state);
      continue;
    }
    RequireGuarantees(parameters, result);
    if (choices.Below(4) != 0) continue;
    const std::string bytes = Serialize(before);
    auto restored = ParseState(bytes);
    RequireOk(restored.status(), "a state reads back");
    Require(Serialize(*restored) == bytes, "a state reads back the same");
    Workspace fresh;
    RequireOk(reconstructor->Reconstruct(frame, *restored, fresh, again),
              "a restored stream takes the same frame");
    Require(result == again && Serialize(*restored) == Serialize(state),
            "a stream goes on from a restored state bit for bit");
  }
}

void AttackFrames(Bytes bytes) {
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileParameters(choices);
  AttackStream(choices, parameters, State{}, 1 + static_cast<int>(choices.Below(3)));
}

}  // namespace partiemc::fuzz
