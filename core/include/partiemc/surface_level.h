// Levels of detail: finished surfaces with fewer triangles, for viewers (core/SURFACES.md,
// "Simplification").
#pragma once

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/surface.h"

namespace partiemc {

/// The requested level of detail. Exactly one member is set.
struct LevelOfDetail {
  /// Limit of the root mean square distance of the level to the exact surface, in spacings, in
  /// (0, 1]. No removed point is farther than twice this from the level.
  std::optional<double> max_error;
  /// Limit of triangles; at least 1. The error of the level is 0 or from a fixed list up to 0.35
  /// spacings: the smallest error that meets the limit. If no error does, the level has the error
  /// 0.35 and more triangles than the limit.
  std::optional<std::uint64_t> max_triangles;

  friend auto operator<=>(const LevelOfDetail&, const LevelOfDetail&) = default;
};

/// Errors: INVALID_ARGUMENT (OUT_OF_RANGE) with the field `level_of_detail`, or its member.
absl::Status Validate(const LevelOfDetail& level);

/// Marks a surface as a level of detail.
struct SurfaceLevel {
  double error = 0;          ///< In spacings; 0: no point was removed.
  std::uint64_t digest = 0;  ///< DigestSurface of the level.

  friend bool operator==(const SurfaceLevel&, const SurfaceLevel&) = default;
};

/// Whether MakeLevel can trust a surface.
enum class SurfaceOrigin : std::uint8_t {
  kCore,     ///< Made by this library: the surface has its guarantees.
  kUnknown,  ///< MakeLevel checks the surface, and limits its own work.
};

/// Estimate of the memory that MakeLevel allocates for a surface of this size, including the
/// surface. `attribute_values`: values of all attributes for each point.
std::uint64_t LevelBytes(std::uint64_t points, std::uint64_t triangles,
                         std::uint64_t attribute_values);

/// Simplifies `surface` to a level, and returns SurfaceLevel::error. `spacing` is in world units.
/// The remaining points keep their bits, normals and attributes; shells keep their measures. Of the
/// guarantees in surface.h, S1 and S2 hold, S4 as in the given surface, and S3 between all
/// triangles that the simplification has changed.
/// Requires: a valid level; indices, offsets and sizes of arrays as in a Surface; normals may be
/// absent. Coordinates may be rounded: triangles that break S3 stay.
/// Runs in the caller's Arena. Deterministic for any number of threads. Errors: CANCELLED after
/// `cancelled` was set. With SurfaceOrigin::kUnknown also DATA_LOSS for a surface that breaks S1 or
/// S2, for coordinates that are not finite or too large, a `spacing` that is no length, and a
/// surface so unlike a result that its simplification takes too much time. After an error `surface`
/// is unspecified. May throw std::bad_alloc.
absl::StatusOr<double> MakeLevel(const LevelOfDetail& level, double spacing, SurfaceOrigin origin,
                                 const std::atomic<bool>* cancelled, Surface& surface);

}  // namespace partiemc
