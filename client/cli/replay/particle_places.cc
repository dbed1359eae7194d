#include "client/cli/replay/particle_places.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string_view>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/cli/replay_parameters.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

constexpr std::string_view kAxisNames = "xyz";

// Number of particles of a frame, evenly selected, that are compared with the walls.
constexpr std::size_t kMostTested = 1'000;

double Length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

double Along(const std::array<double, 3>& normal, const double* position) {
  return normal[0] * position[0] + normal[1] * position[1] + normal[2] * position[2];
}

// Whether a point is on the right of an endless line, outside of a tank (counter-clockwise) or
// inside of an obstacle (clockwise).
bool IsBehind(std::span<const double> wall, double x, double y) {
  const std::size_t count = wall.size() / 2;
  double twice_area = 0;
  bool is_inside = false;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = (k + 1) % count;
    const double ax = wall[2 * k] - x, ay = wall[2 * k + 1] - y;
    const double bx = wall[2 * next] - x, by = wall[2 * next + 1] - y;
    const double cross = ax * by - bx * ay;
    if (count == 2) return cross < 0;
    twice_area += cross;
    if ((ay > 0) != (by > 0) && (cross > 0) == (by > ay)) is_inside = !is_inside;
  }
  return twice_area > 0 ? !is_inside : is_inside;
}

// The values of an attribute of a frame; empty without it.
std::span<const float> ValuesOf(const RecordedFrame& frame, const std::string& name) {
  const auto found = std::ranges::find(frame.attributes, name, &ParticleAttribute::name);
  if (found == frame.attributes.end() || found->components != 1) return {};
  return found->values;
}

}  // namespace

ParticlePlaces::ParticlePlaces(const ReplayFlags& flags, const ReconstructionParameters& parameters)
    : parameters_(parameters) {
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
  if (frame.components == 3) {
    for (Range& slice : slices_) {
      for (std::size_t k = 0; k < frame.positions.size(); k += 3) {
        const double along = Along(slice.normal, &frame.positions[k]);
        slice.low = std::min(slice.low, along);
        slice.high = std::max(slice.high, along);
      }
    }
  }
  if (behind_walls_.empty()) CountBehindWalls(frame);
}

std::string ParticlePlaces::WallBefore(const double* position, int components) const {
  for (std::size_t k = 0; k < parameters_.walls.size(); ++k) {
    if (IsBehind(parameters_.walls[k].points, position[0], position[1])) {
      return Concat("--wall number ", k + 1);
    }
  }
  for (std::size_t k = 0; components == 3 && k < parameters_.wall_planes.size(); ++k) {
    const WallPlane& plane = parameters_.wall_planes[k];
    const double height = position[plane.axis] - plane.position;
    if (plane.is_fluid_above ? height < 0 : height > 0) {
      return Concat("--wall-plane number ", k + 1);
    }
  }
  return "";
}

void ParticlePlaces::CountBehindWalls(const RecordedFrame& frame) {
  if (parameters_.walls.empty() && parameters_.wall_planes.empty()) return;
  const std::span<const float> phases = ValuesOf(frame, parameters_.phase_attribute);
  const auto is_wall = [&](std::size_t particle) {
    return !phases.empty() && std::ranges::any_of(parameters_.wall_phases, [&](int phase) {
      return phases[particle] == static_cast<float>(phase);
    });
  };
  const std::size_t step = frame.ParticleCount() / kMostTested + 1;
  std::size_t tested = 0, behind = 0;
  std::map<std::string, std::size_t> counts;
  for (std::size_t k = 0; k < frame.ParticleCount(); k += step) {
    if (is_wall(k)) continue;
    ++tested;
    const std::string wall = WallBefore(
        &frame.positions[k * static_cast<std::size_t>(frame.components)], frame.components);
    if (wall.empty()) continue;
    ++behind;
    ++counts[wall];
  }
  if (2 * behind <= tested) return;
  const auto worst =
      std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
  behind_walls_ =
      Concat(frame.source, ": ", behind == frame.ParticleCount() ? "all" : "most",
             " particles are behind a wall (", worst->first,
             "), so they are not part of the fluid. The fluid is ",
             worst->first.starts_with("--wall-plane")
                 ? "above --wall-plane, and below it with `below`"
                 : "on the left of --wall: a tank is counter-clockwise, an obstacle clockwise");
}

std::vector<std::string> ParticlePlaces::Warnings() const {
  std::vector<std::string> warnings;
  // The outline is half a spacing outside of the particles.
  const double reach = .5 * parameters_.spacing.value_or(0);
  for (const Range& slice : slices_) {
    const bool has_particles = slice.low <= slice.high;
    const bool is_beside = slice.plane < slice.low - reach || slice.plane > slice.high + reach;
    if (!has_particles || !is_beside) continue;
    warnings.push_back(absl::StrFormat(
        "--slice %s: the plane meets no particle; along %s it is at %.4g, and the particles are "
        "from %.4g to %.4g",
        slice.text, slice.axis, slice.plane, slice.low, slice.high));
  }
  if (!behind_walls_.empty()) warnings.push_back(behind_walls_);
  return warnings;
}

}  // namespace partiemc::client
