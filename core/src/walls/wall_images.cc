#include "walls/wall_images.h"

#include <algorithm>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/bits.h"
#include "base/cancellation.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

constexpr std::size_t kAxes = 3;

// Bytes of a particle in a WallImageScratch. Vectors that grow may hold twice as much.
std::uint64_t BytesOfParticle(const Frame& frame) {
  std::uint64_t bytes = 2 * (kAxes * sizeof(double) + sizeof(std::uint32_t));
  if (!frame.volumes.empty()) bytes += sizeof(float);
  if (!frame.ids.empty()) bytes += sizeof(std::uint64_t);
  if (!frame.velocities.empty()) bytes += kAxes * sizeof(float);
  for (const Attribute& attribute : frame.attributes) {
    bytes += sizeof(float) * static_cast<std::uint64_t>(attribute.components);
  }
  return bytes;
}

// Copies the values of each particle from its original.
template <typename Value>
std::span<const Value> Gather(std::span<const Value> from, std::size_t components,
                              std::span<const std::uint32_t> originals, std::vector<Value>& to) {
  to.clear();
  if (from.empty()) return {};
  to.reserve(components * originals.size());
  for (const std::uint32_t original : originals) {
    const auto first = from.begin() + static_cast<std::ptrdiff_t>(components * original);
    to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(components));
  }
  return to;
}

// The size of a particle: the unit of the lengths of WallImageInput. 1 for equal sizes.
double SizeOf(const WallImageInput& input, std::size_t particle) {
  return input.kernel_radius > 0 ? CubeRoot(double{input.frame.volumes[particle]}) : 1;
}

// How far before a wall a particle has an image.
double DepthOf(const WallImageInput& input, std::size_t particle) {
  return input.depth > 0 ? input.depth + input.kernel_radius * SizeOf(input, particle) : 0;
}

// Calls visit(position, number) for the particles that have an effect. Those that are nearer to a
// wall than `nearest`, or behind it, move to this distance before it, so that each has an image.
template <typename Real, typename Visit>
void ForEachNear(std::span<const Real> positions, const WallImageInput& input, const FluidBox& box,
                 const Visit& visit) {
  for (std::size_t particle = 0; particle < positions.size() / kAxes; ++particle) {
    const double size = SizeOf(input, particle);
    const double tolerance = input.tolerance * size, nearest = input.nearest * size;
    std::array<double, kAxes> at;
    bool is_near = true;
    for (std::size_t k = 0; k < kAxes; ++k) {
      at[k] = static_cast<double>(positions[kAxes * particle + k]);
      is_near = is_near && at[k] >= box.low[k] - tolerance && at[k] <= box.high[k] + tolerance;
      at[k] = std::min(std::max(at[k], box.low[k] + nearest), box.high[k] - nearest);
    }
    if (is_near) visit(at, static_cast<std::uint32_t>(particle));
  }
}

// The number of images of a particle, with itself.
std::uint64_t CountImages(const std::array<double, kAxes>& at, const FluidBox& box, double depth) {
  std::uint64_t count = 1;
  for (std::size_t k = 0; k < kAxes; ++k) {
    const double above = at[k] - box.low[k], below = box.high[k] - at[k];
    count *= std::uint64_t{1} + (above > 0 && above <= depth) + (below > 0 && below <= depth);
  }
  return count;
}

// Appends the images along one axis of all particles so far.
void MirrorAlong(std::size_t axis, const WallImageInput& input, const FluidBox& box,
                 WallImageScratch& s) {
  const std::size_t count = s.originals.size();
  const auto add = [&](std::size_t particle, double wall) {
    for (std::size_t k = 0; k < kAxes; ++k) {
      const double at = s.positions[kAxes * particle + k];
      s.positions.push_back(k == axis ? wall + (wall - at) : at);
    }
    s.originals.push_back(s.originals[particle]);
    if (s.velocities.empty()) return;
    for (std::size_t k = 0; k < kAxes; ++k) {
      const float velocity = s.velocities[kAxes * particle + k];
      s.velocities.push_back(k == axis ? -velocity : velocity);
    }
  };
  for (std::size_t particle = 0; particle < count; ++particle) {
    const double at = s.positions[kAxes * particle + axis];
    const double above = at - box.low[axis], below = box.high[axis] - at;
    const double depth = DepthOf(input, s.originals[particle]);
    if (above > 0 && above <= depth) add(particle, box.low[axis]);
    if (below > 0 && below <= depth) add(particle, box.high[axis]);
  }
}

}  // namespace

FluidBox FluidBoxOf(std::span<const WallPlane> planes) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  FluidBox box{{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
  for (const WallPlane& plane : planes) {
    const auto axis = static_cast<std::size_t>(plane.axis);
    (plane.is_fluid_above ? box.low : box.high)[axis] = plane.position;
  }
  return box;
}

absl::Status AddWallImages(const WallImageInput& input, WallImageScratch& s, Frame& with_images,
                           std::size_t& particles) {
  const Frame& given = input.frame;
  const FluidBox box = FluidBoxOf(input.planes);
  const auto for_each_near = [&](const auto& visit) {
    std::visit([&](auto positions) { ForEachNear(positions, input, box, visit); }, given.positions);
  };
  std::uint64_t all = 0;
  for_each_near([&](const std::array<double, kAxes>& at, std::uint32_t particle) {
    all += CountImages(at, box, DepthOf(input, particle));
  });
  if (all > FrameLimits::kMostParticles) {
    return InvalidFrame(kReasonTooManyParticles, "positions", absl::StrCat(all),
                        absl::StrCat("must be at most ", FrameLimits::kMostParticles,
                                     " with the mirror images behind walls"));
  }
  if (absl::Status status = input.reserve(all * BytesOfParticle(given)); !status.ok()) {
    return status;
  }
  s.positions.clear();
  s.originals.clear();
  s.positions.reserve(kAxes * all);
  s.originals.reserve(all);
  for_each_near([&](const std::array<double, kAxes>& at, std::uint32_t particle) {
    s.positions.insert(s.positions.end(), at.begin(), at.end());
    s.originals.push_back(particle);
  });
  ThrowIfCancelled();
  particles = s.originals.size();
  s.velocities.reserve(given.velocities.empty() ? 0 : kAxes * all);
  Gather(given.velocities, kAxes, s.originals, s.velocities);
  for (std::size_t axis = 0; axis < kAxes; ++axis) MirrorAlong(axis, input, box, s);
  with_images = given;
  with_images.positions = std::span<const double>(s.positions);
  with_images.velocities = s.velocities;
  with_images.volumes = Gather(given.volumes, 1, s.originals, s.volumes);
  with_images.ids = Gather(given.ids, 1, s.originals, s.ids);
  s.attributes.assign(given.attributes.begin(), given.attributes.end());
  s.values.resize(std::max(s.values.size(), s.attributes.size()));
  for (std::size_t k = 0; k < s.attributes.size(); ++k) {
    Attribute& attribute = s.attributes[k];
    attribute.values = Gather(attribute.values, static_cast<std::size_t>(attribute.components),
                              s.originals, s.values[k]);
  }
  with_images.attributes = s.attributes;
  return absl::OkStatus();
}

}  // namespace partiemc
