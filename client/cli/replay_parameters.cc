#include "client/cli/replay_parameters.h"

#include <charconv>
#include <cmath>
#include <string>

#include "client/cli/console.h"
#include "client/output/text.h"

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

}  // namespace

std::optional<double> PositiveNumber(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(value > 0 && std::isfinite(value))) return std::nullopt;
  return value;
}

absl::StatusOr<ReconstructionParameters> ParametersOf(const ReplayFlags& flags,
                                                      std::optional<double> recorded_spacing) {
  ReconstructionParameters parameters{.spacing = recorded_spacing,
                                      .kernel_radius = flags.kernel_radius,
                                      .cell_size = flags.cell_size,
                                      .reference_radius = flags.reference_radius,
                                      .surface_offset = flags.surface_offset,
                                      .normal_memory = !flags.no_normal_memory,
                                      .min_component_area = flags.min_area,
                                      .min_component_particles = flags.min_particles};
  const auto placement = FindPlacement(flags.placement);
  if (!placement) return WrongFlag("--placement", flags.placement, Names(AllPlacements()));
  parameters.placement = *placement;
  const auto fill = FindFill(flags.fill);
  if (!fill) return WrongFlag("--fill", flags.fill, Names(AllFills()));
  parameters.fill = *fill;

  if (flags.spacing == "first-frame" || flags.spacing == "every-frame") {
    parameters.spacing.reset();
    parameters.spacing_rule =
        flags.spacing == "first-frame" ? SpacingRule::kFirstFrame : SpacingRule::kEveryFrame;
  } else if (!flags.spacing.empty()) {
    parameters.spacing = PositiveNumber(flags.spacing);
    if (!parameters.spacing) {
      return WrongFlag("--spacing", flags.spacing, "a positive length, first-frame or every-frame");
    }
  }
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
