#include "wire/surface_level.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "partiemc/result.h"
#include "partiemc/status.h"
#include "wire/result_parts.h"
#include "wire/surface_codec.h"

namespace partiemc::wire {
namespace {

// The last entry of an array of offsets: the number of points or triangles.
std::uint64_t LastOf(const std::string& offsets) {
  std::uint32_t last = 0;
  if (offsets.size() >= sizeof last) {
    std::memcpy(&last, offsets.data() + offsets.size() - sizeof last, sizeof last);
  }
  return last;
}

// Before memory is reserved, refuses counts that are too large for the arrays in every format.
absl::Status CheckCounts(const v1::Surface& surface) {
  // The vertex codec stores at least a 64th of the 12 bytes of a point, the index codec at least a
  // byte for each triangle (compact_surface.cc).
  constexpr std::uint64_t kMostPointsOfByte = 6;
  if (LastOf(surface.point_offsets()) > kMostPointsOfByte * surface.points().size()) {
    return Lost("surface.point_offsets", "gives more points than surface.points can hold");
  }
  if (LastOf(surface.triangle_offsets()) > surface.triangles().size()) {
    return Lost("surface.triangle_offsets", "gives more triangles than surface.triangles can hold");
  }
  return absl::OkStatus();
}

std::uint64_t BytesOfLevel(const v1::Surface& surface) {
  // Three surfaces exist at a time, each with its names of attributes and its parents.
  constexpr std::uint64_t kCopies = 3, kBytesOfParent = 40;
  std::uint64_t values = 0, names = 0, parents = 0;
  // DecodeSurface refuses more components.
  for (const v1::NamedAttribute& attribute : surface.attributes()) {
    values += std::min(attribute.components(), 3u);
    names += attribute.name().size();
  }
  for (const v1::ShellMeasures& measures : surface.measures()) {
    parents += static_cast<std::uint64_t>(measures.parent_identities_size());
  }
  return LevelBytes(LastOf(surface.point_offsets()), LastOf(surface.triangle_offsets()), values) +
         kCopies * names + kBytesOfParent * parents;
}

}  // namespace

absl::StatusOr<LevelOfDetail> DecodeLevelOfDetail(const v1::LevelOfDetail& message) {
  LevelOfDetail level;
  if (message.has_max_error()) level.max_error = message.max_error();
  if (message.has_max_triangles()) level.max_triangles = message.max_triangles();
  const absl::Status status = Validate(level);
  if (status.ok()) return level;
  auto violation = *FindViolation(status);
  violation.field = absl::StrCat("open.", violation.field);
  return ViolationError(status.code(), violation);
}

void EncodeLevelOfDetail(const LevelOfDetail& level, v1::LevelOfDetail& message) {
  message.Clear();
  if (level.max_error) message.set_max_error(*level.max_error);
  if (level.max_triangles) message.set_max_triangles(*level.max_triangles);
}

std::optional<SurfaceLevel> LevelOf(const v1::ReconstructedFrame& message) {
  if (!message.surface().has_level()) return std::nullopt;
  const v1::SurfaceLevel& level = message.surface().level();
  return SurfaceLevel{.error = level.error(), .digest = level.digest()};
}

absl::Status ReplaceByLevel(const LevelOfDetail& level, SurfaceOrigin origin,
                            absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve,
                            const std::atomic<bool>* cancelled, v1::ReconstructedFrame& message) {
  if (!message.has_surface()) return absl::OkStatus();
  v1::Surface& surface = *message.mutable_surface();
  absl::Status status = CheckCounts(surface);
  if (status.ok()) status = reserve(BytesOfLevel(surface));
  Surface decoded;
  if (status.ok()) status = DecodeSurface(message, decoded);
  if (!status.ok()) return status;
  const double spacing = message.statistics().spacing();
  double error = 0;
  if (decoded.ShellCount() > 0) {
    const auto made = MakeLevel(level, spacing, origin, cancelled, decoded);
    if (!made.ok()) return made.status();
    error = *made;
  }
  // `error` is 0 if no point was removed; the message then keeps the exact surface.
  if (error > 0) status = ReplaceGeometry(decoded, spacing, message);
  // The digest is over points and triangles in the order of the message.
  if (status.ok()) status = DecodeSurface(message, decoded);
  if (!status.ok()) return status;
  surface.mutable_level()->set_error(error);
  surface.mutable_level()->set_digest(DigestSurface(decoded));
  return absl::OkStatus();
}

}  // namespace partiemc::wire
