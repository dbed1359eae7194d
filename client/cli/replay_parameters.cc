#include "client/cli/replay_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/console.h"
#include "client/output/text.h"
#include "common/text.h"

namespace partiemc::client {
namespace {

absl::Status WrongFlag(std::string_view flag, std::string_view value, std::string_view rule) {
  return absl::InvalidArgumentError(Concat(flag, ": '", value, "'; must be ", rule));
}

template <typename Value>
std::string Names(std::span<const Value> values) {
  std::string names;
  for (const Value value : values) AppendAll(names, names.empty() ? "" : ", ", Name(value));
  return names;
}

std::optional<double> Number(std::string_view text) {
  const auto number = ParseNumber<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

// Numbers, separated by commas. Empty if one is wrong.
std::vector<double> Numbers(std::string_view text) {
  std::vector<double> numbers;
  for (const std::string_view part : Split(text, ',', /*blanks=*/"")) {
    const auto number = Number(part);
    if (!number) return {};
    numbers.push_back(*number);
  }
  return numbers;
}

// Parses --box. Empty if the text does not have four or six numbers.
std::optional<RecordedBox> BoxOf(std::string_view text) {
  const std::vector<double> bounds = Numbers(text);
  if (bounds.size() != 4 && bounds.size() != 6) return std::nullopt;
  RecordedBox box;
  for (std::size_t k = 0; 2 * k < bounds.size(); ++k) {
    box.low[k] = bounds[2 * k];
    box.length[k] = bounds[2 * k + 1] - bounds[2 * k];
    box.is_periodic[k] = true;
  }
  return box;
}

// Sets the periodic box. If --box and `recorded` are absent, only checks --periodic.
absl::Status SetBox(const ReplayFlags& flags, const std::optional<RecordedBox>& recorded,
                    ReconstructionParameters& parameters) {
  if (flags.periodic.empty()) return absl::OkStatus();
  std::optional<RecordedBox> bounds = recorded;
  if (!flags.box.empty()) {
    bounds = BoxOf(flags.box);
    if (!bounds) return WrongFlag("--box", flags.box, "X0,X1,Y0,Y1 or X0,X1,Y0,Y1,Z0,Z1");
  }
  PeriodicBox box;
  for (const std::string_view name : Split(flags.periodic, ',', /*blanks=*/"")) {
    const bool is_axis = name == "x" || name == "y" || (name == "z" && flags.surface);
    if (!is_axis) {
      return WrongFlag("--periodic", flags.periodic,
                       flags.surface ? "axes of x,y,z" : "axes of x,y: z requires --surface");
    }
    const auto axis = static_cast<std::size_t>(name[0] - 'x');
    if (!bounds) continue;
    if (!bounds->is_periodic[axis] && !flags.box.empty()) {
      return WrongFlag("--box", flags.box, "X0,X1,Y0,Y1,Z0,Z1, because --periodic has the axis z");
    }
    if (!bounds->is_periodic[axis]) {
      return WrongFlag("--periodic", flags.periodic,
                       Concat("axes along which the box of the input is periodic; it is not along ",
                              name, ". --box gives another box"));
    }
    box.axes[axis] = PeriodicAxis{bounds->low[axis], bounds->length[axis]};
  }
  box.wraps = flags.wrap;
  if (bounds) parameters.box = box;
  return absl::OkStatus();
}

// The name in "NAME=1,2"; empty without one.
std::string AttributeOf(std::string_view text) {
  const std::size_t end = text.find('=');
  return std::string(text.substr(0, end == std::string_view::npos ? 0 : end));
}

// Parses "NAME=1,2", an attribute and phases. Returns false for any other text.
bool ParsePhases(std::string_view text, std::string& attribute, std::vector<std::int32_t>& phases) {
  attribute = AttributeOf(text);
  if (attribute.empty()) return false;
  for (const std::string_view of : Split(text.substr(attribute.size() + 1), ',', /*blanks=*/"")) {
    const auto phase = Number(of);
    if (!phase || *phase != std::floor(*phase) || std::abs(*phase) > 0x1p24) return false;
    phases.push_back(static_cast<std::int32_t>(*phase));
  }
  return true;
}

absl::Status AddPhases(const ReplayFlags& flags, ReconstructionParameters& parameters) {
  if (flags.phases.empty()) return absl::OkStatus();
  std::vector<std::int32_t> phases;
  if (!ParsePhases(flags.phases, parameters.phase_attribute, phases)) {
    return WrongFlag("--phases", flags.phases, "an attribute and whole numbers: type=1,2");
  }
  for (const std::int32_t phase : phases) parameters.sections.push_back({.phase = phase});
  return absl::OkStatus();
}

// Parses each --wall-plane. The core's Validate checks them against each other.
absl::Status AddWallPlanes(const ReplayFlags& flags, ReconstructionParameters& parameters) {
  if (!flags.wall_planes.empty() && !flags.surface) {
    return WrongFlag("--wall-plane", flags.wall_planes.front(),
                     "used with --surface; outlines have --wall X0,Y0,X1,Y1");
  }
  constexpr std::string_view kAxes = "xyz", kBelow = ",below", kAbove = ",above";
  for (const std::string& text : flags.wall_planes) {
    std::string_view rest = text;
    const bool is_below = rest.ends_with(kBelow);
    if (is_below || rest.ends_with(kAbove)) rest.remove_suffix(kBelow.size());
    const std::size_t axis = rest.empty() ? kAxes.npos : kAxes.find(rest.front());
    if (axis != kAxes.npos && rest.substr(1).starts_with('=')) {
      const std::vector<double> position = Numbers(std::string(rest.substr(2)));
      if (position.size() == 1) {
        parameters.wall_planes.push_back({static_cast<int>(axis), position[0], !is_below});
        continue;
      }
    }
    return WrongFlag("--wall-plane", text,
                     "x, y or z and a coordinate: z=0 with the fluid above, or z=5,below");
  }
  return absl::OkStatus();
}

// Parses each --wall. The core's Validate checks the shape of the walls.
absl::Status AddWalls(const ReplayFlags& flags, ReconstructionParameters& parameters) {
  for (const std::string& text : flags.walls) {
    if (text.starts_with("x=") || text.starts_with("y=") || text.starts_with("z=")) {
      return WrongFlag(
          "--wall", text,
          "two points of the line, with the fluid on its left, such as 0,0,1,0 for the "
          "floor y = 0; a surface has --wall-plane z=0");
    }
    if (text.find('=') != std::string::npos) {
      const std::string known = !flags.phases.empty()             ? AttributeOf(flags.phases)
                                : !parameters.wall_phases.empty() ? parameters.phase_attribute
                                                                  : AttributeOf(text);
      if (AttributeOf(text) != known ||
          !ParsePhases(text, parameters.phase_attribute, parameters.wall_phases)) {
        return WrongFlag("--wall", text,
                         flags.phases.empty()
                             ? "one attribute and whole numbers, such as type=2"
                             : "the attribute of --phases and whole numbers, such as type=2");
      }
      continue;
    }
    const std::vector<double> points = Numbers(text);
    if (points.size() < 4 || points.size() % 2 != 0) {
      return WrongFlag("--wall", text, "X0,Y0,X1,Y1,...: two points or more; or particles: type=2");
    }
    parameters.walls.push_back({points});
  }
  return absl::OkStatus();
}

// Makes the first slice the stream's slice, unless the stream has a surface. Adds a section for the
// outline of each other slice. Adds a section for each isoline on each slice; without slices, for
// each isoline in the plane of the stream.
absl::Status AddSections(const ReplayFlags& flags, ReconstructionParameters& parameters) {
  const auto add_isolines = [&](const std::optional<SlicePlane>& slice) {
    for (const double isovalue : flags.isolines) {
      parameters.sections.push_back({.slice = slice, .isovalue = isovalue});
    }
  };
  if (flags.slices.empty()) add_isolines(std::nullopt);
  for (const std::string& text : flags.slices) {
    const auto slice = SliceOf(text);
    if (!slice) return WrongFlag("--slice", text, "x=C, y=C, z=C or OX,OY,OZ,NX,NY,NZ");
    if (!parameters.slice && !flags.surface) {
      parameters.slice = slice;
    } else {
      parameters.sections.push_back({.slice = slice});
    }
    add_isolines(slice);
  }
  return absl::OkStatus();
}

}  // namespace

std::optional<SlicePlane> SliceOf(std::string_view text) {
  if (text.size() > 2 && text[1] == '=' && text[0] >= 'x' && text[0] <= 'z') {
    const auto at = Number(text.substr(2));
    if (!at) return std::nullopt;
    const auto axis = static_cast<std::size_t>(text[0] - 'x');
    SlicePlane slice{.normal = {}};
    slice.origin[axis] = *at;
    // With this sign of the normal, the picture has the two other axes in alphabetical order.
    slice.normal[axis] = axis == 1 ? -1 : 1;
    return slice;
  }
  const std::vector<double> numbers = Numbers(text);
  if (numbers.size() != 6) return std::nullopt;
  SlicePlane slice;
  std::copy_n(numbers.begin(), 3, slice.origin.begin());
  std::copy_n(numbers.begin() + 3, 3, slice.normal.begin());
  return slice;
}

std::optional<double> PositiveNumber(std::string_view text) {
  const auto value = Number(text);
  return value && *value > 0 ? value : std::nullopt;
}

std::string PhaseAttributeOf(const ReplayFlags& flags) {
  if (!flags.phases.empty()) return AttributeOf(flags.phases);
  for (const std::string& wall : flags.walls) {
    if (const std::string attribute = AttributeOf(wall); !attribute.empty()) return attribute;
  }
  return "";
}

bool IsEstimatedInSpace(const ReplayFlags& flags, std::optional<double> recorded_spacing) {
  if (!flags.sequence.in_space) return false;
  return flags.spacing.empty() ? !recorded_spacing : flags.spacing == "first-frame";
}

absl::StatusOr<ReconstructionParameters> ParametersOf(const ReplayFlags& flags,
                                                      std::optional<double> spacing,
                                                      const std::optional<RecordedBox>& box) {
  ReconstructionParameters parameters{.output = flags.surface ? Output::kSurface : Output::kOutline,
                                      .spacing = spacing,
                                      .kernel_radius = flags.kernel_radius,
                                      .cell_size = flags.cell_size,
                                      .reference_radius = flags.reference_radius,
                                      .surface_offset = flags.surface_offset,
                                      .attribute_tolerance = flags.attribute_tolerance,
                                      .normal_memory = !flags.no_normal_memory,
                                      .min_component_area = flags.min_area,
                                      .min_component_particles = flags.min_particles,
                                      .surface = flags.surface_options,
                                      .noise_filter = flags.noise_filter};
  const auto placement = FindPlacement(flags.placement);
  if (!placement) return WrongFlag("--placement", flags.placement, Names(AllPlacements()));
  parameters.placement = *placement;
  const auto fill = FindFill(flags.fill);
  if (!fill) return WrongFlag("--fill", flags.fill, Names(AllFills()));
  parameters.fill = *fill;
  if (flags.sizes == Name(Sizes::kOwn)) {
    parameters.sizes = Sizes::kOwn;
  } else if (flags.sizes != Name(Sizes::kEqual)) {
    return WrongFlag("--sizes", flags.sizes, "equal or own");
  }
  if (flags.boundary == Name(Boundary::kGrains)) {
    parameters.sizes = Sizes::kOwn;
    parameters.boundary = Boundary::kGrains;
  } else if (flags.boundary != Name(Boundary::kBulk)) {
    return WrongFlag("--boundary", flags.boundary, "bulk or grains");
  }

  if (flags.spacing == "first-frame" || flags.spacing == "every-frame") {
    // In space, first-frame uses the estimate in `spacing`.
    if (!IsEstimatedInSpace(flags, std::nullopt)) parameters.spacing.reset();
    parameters.spacing_rule =
        flags.spacing == "first-frame" ? SpacingRule::kFirstFrame : SpacingRule::kEveryFrame;
  } else if (!flags.spacing.empty()) {
    parameters.spacing = PositiveNumber(flags.spacing);
    if (!parameters.spacing) {
      return WrongFlag("--spacing", flags.spacing, "a positive length, first-frame or every-frame");
    }
  }
  if (auto status = AddSections(flags, parameters); !status.ok()) return status;
  if (auto status = AddPhases(flags, parameters); !status.ok()) return status;
  if (auto status = AddWalls(flags, parameters); !status.ok()) return status;
  if (auto status = AddWallPlanes(flags, parameters); !status.ok()) return status;
  if (auto status = SetBox(flags, box, parameters); !status.ok()) return status;
  if (flags.clean == "on" || flags.clean == "off") {
    parameters.clean = flags.clean == "on";
  } else if (flags.clean != "auto") {
    return WrongFlag("--clean", flags.clean, "on, off or auto");
  }
  if (!(flags.min_area >= 0 && std::isfinite(flags.min_area))) {
    return WrongFlag("--min-area", Concat(flags.min_area), "0 or more squared spacings");
  }
  const absl::Status valid = Validate(parameters);
  if (!valid.ok()) return absl::InvalidArgumentError(AsFlag(valid));
  return parameters;
}

absl::StatusOr<std::optional<double>> RateOf(std::string_view text) {
  if (text == "max") return std::optional<double>();
  const auto rate = PositiveNumber(text);
  if (!rate) return WrongFlag("--rate", text, "a positive number of frames per second, or max");
  return rate;
}

}  // namespace partiemc::client
