#include "client/cli/replay/particle_places.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/cli/replay_parameters.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

constexpr std::string_view kAxisNames = "xyz";

double Length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

double Along(const std::array<double, 3>& normal, const double* position) {
  return normal[0] * position[0] + normal[1] * position[1] + normal[2] * position[2];
}

}  // namespace

ParticlePlaces::ParticlePlaces(const ReplayFlags& flags, const ReconstructionParameters& parameters)
    : reach_(.5 * parameters.spacing.value_or(0)) {
  for (const std::string& text : flags.slices) {
    const auto slice = SliceOf(text);
    if (!slice) continue;
    Range range{.text = text, .axis = "its normal", .normal = slice->normal};
    const double length = Length(range.normal);
    for (double& component : range.normal) component /= length;
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::abs(range.normal[k]) != 1) continue;
      range.normal[k] = 1;
      range.axis = kAxisNames[k];
    }
    range.plane = Along(range.normal, slice->origin.data());
    slices_.push_back(std::move(range));
  }
}

void ParticlePlaces::Add(const RecordedFrame& frame) {
  if (frame.components != 3) return;
  for (Range& slice : slices_) {
    for (std::size_t k = 0; k < frame.positions.size(); k += 3) {
      const double along = Along(slice.normal, &frame.positions[k]);
      slice.low = std::min(slice.low, along);
      slice.high = std::max(slice.high, along);
    }
  }
}

std::vector<std::string> ParticlePlaces::Warnings() const {
  std::vector<std::string> warnings;
  for (const Range& slice : slices_) {
    const bool has_particles = slice.low <= slice.high;
    const bool is_beside = slice.plane < slice.low - reach_ || slice.plane > slice.high + reach_;
    if (!has_particles || !is_beside) continue;
    warnings.push_back(absl::StrFormat(
        "--slice %s: the plane meets no particle; along %s it is at %.4g, and the particles are "
        "from %.4g to %.4g",
        slice.text, slice.axis, slice.plane, slice.low, slice.high));
  }
  return warnings;
}

}  // namespace partiemc::client
