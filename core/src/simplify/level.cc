#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation.h"
#include "base/predicates_in_space.h"
#include "check/work_limit.h"
#include "partiemc/status.h"
#include "partiemc/surface_level.h"
#include "simplify/mesh_faults.h"
#include "simplify/simplify.h"
#include "space/surface_bytes.h"

namespace partiemc {
namespace {

// The errors that SimplifyToCount tries, in spacings. The number of triangles is about inversely
// proportional to the error, so steps of about 1.4 leave at most a third of the limit unused. With
// larger errors more shells break a guarantee and keep their triangles.
constexpr std::array kErrors = {.015, .02, .03, .04, .06, .08, .12, .17, .25, .35};

// Bytes for the exact surface, the best level so far and the next level. A point has coordinates, a
// normal and new indices. The simplification copies triangles.
constexpr std::uint64_t kBytesPerPoint = 3 * (24 + 12) + 8, kBytesPerTriangle = 5 * 12 + 16;

absl::Status OutOfRange(std::string field, std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonOutOfRange), std::move(field), std::move(value), std::move(rule)});
}

// Limits for surfaces of unknown origin, for each triangle: the work of one simplification, and the
// sum over points of the squared number of their triangles. A surface with fewer than kFewTriangles
// has the limits of that number.
constexpr std::uint64_t kMostWork = 1 << 16, kMostDegrees = 1 << 10;
constexpr std::uint64_t kFewTriangles = 1 << 12;
// Largest coordinate, in spacings.
constexpr double kFarthestCoordinate = 0x1p40;

template <typename... Parts>
absl::Status Unfit(const Parts&... parts) {
  return absl::DataLossError(absl::StrCat("surface: ", parts...));
}

std::uint64_t AtLeastFew(const Surface& surface) {
  return std::max<std::uint64_t>(surface.TriangleCount(), kFewTriangles);
}

// Checks coordinates (the domain of exact arithmetic), the numbers of triangles at points, S1, S2
// and that shells are connected. Requires: indices and sizes as in a Surface.
absl::Status Check(const Surface& surface, double spacing) {
  if (!(spacing > 0) || !InSpaceDomain(spacing)) {
    return Unfit("the spacing ", ShortestNumber(spacing), " is no length");
  }
  for (const double coordinate : surface.points) {
    if (InSpaceDomain(coordinate) && std::abs(coordinate) <= kFarthestCoordinate * spacing)
      continue;
    return Unfit("a point has the coordinate ", ShortestNumber(coordinate), ", with the spacing ",
                 ShortestNumber(spacing));
  }
  std::vector<std::uint32_t> degrees(surface.PointCount(), 0);
  for (const std::uint32_t point : surface.triangles) ++degrees[point];
  std::uint64_t squares = 0;
  for (const std::uint32_t degree : degrees) squares += std::uint64_t{degree} * degree;
  if (squares > kMostDegrees * AtLeastFew(surface)) return Unfit("too many triangles at a point");
  std::vector<simplify::Box> faults;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const std::size_t first = surface.triangle_offsets[shell];
    const auto triangles =
        std::span<const std::uint32_t>(surface.triangles)
            .subspan(3 * first, 3 * (surface.triangle_offsets[shell + 1] - first));
    ThrowIfCancelled();
    simplify::FindManifoldFaults(surface.points, triangles, faults);
    if (!faults.empty()) return Unfit("shell ", shell, " is not closed, or not manifold");
    if (!simplify::IsConnected(triangles,
                               surface.point_offsets[shell + 1] - surface.point_offsets[shell])) {
      return Unfit("shell ", shell, " is not connected");
    }
  }
  return absl::OkStatus();
}

// Simplifies `surface`, but leaves the measures of the exact surface. `error`: in spacings.
void SimplifyBy(double error, double spacing, SurfaceOrigin origin, Surface& surface) {
  std::vector<ShellMeasures> exact = surface.measures;
  WorkLimit work(kMostWork * AtLeastFew(surface));
  simplify::Simplify({.error = error * spacing,
                      .spacing = spacing,
                      .work = origin == SurfaceOrigin::kUnknown ? &work : nullptr},
                     surface);
  surface.measures = std::move(exact);
}

// Simplifies by the smallest error of kErrors that meets the limit, found by bisection; by the
// largest one if none does. Returns the error.
double SimplifyToCount(std::uint64_t max_triangles, double spacing, SurfaceOrigin origin,
                       Surface& surface) {
  std::size_t first = 0, last = kErrors.size() - 1;
  Surface best = surface;
  SimplifyBy(kErrors[last], spacing, origin, best);
  while (first < last && best.TriangleCount() <= max_triangles) {
    const std::size_t middle = first + (last - first) / 2;
    Surface level = surface;
    SimplifyBy(kErrors[middle], spacing, origin, level);
    if (level.TriangleCount() <= max_triangles) {
      best = std::move(level);
      last = middle;
    } else {
      first = middle + 1;
    }
  }
  surface = std::move(best);
  return kErrors[last];
}

}  // namespace

absl::Status Validate(const LevelOfDetail& level) {
  if (level.max_error.has_value() == level.max_triangles.has_value()) {
    return OutOfRange("level_of_detail", level.max_error ? "two limits" : "no limit",
                      "must have either max_error or max_triangles");
  }
  // This form of the comparison refuses NaN, too.
  if (level.max_error && !(*level.max_error > 0 && *level.max_error <= 1)) {
    return OutOfRange("level_of_detail.max_error", ShortestNumber(*level.max_error),
                      "must be in (0, 1], in spacings");
  }
  if (level.max_triangles == 0u) {
    return OutOfRange("level_of_detail.max_triangles", "0", "must be at least 1");
  }
  return absl::OkStatus();
}

std::uint64_t LevelBytes(std::uint64_t points, std::uint64_t triangles,
                         std::uint64_t attribute_values) {
  return space::kBytesAtLeast + kBytesPerTriangle * triangles +
         (kBytesPerPoint + space::kBytesPerSimplifiedPoint + 3 * sizeof(float) * attribute_values) *
             points;
}

absl::StatusOr<double> MakeLevel(const LevelOfDetail& level, double spacing, SurfaceOrigin origin,
                                 const std::atomic<bool>* cancelled, Surface& surface) {
  const CancellationScope scope(cancelled);
  const std::size_t exact = surface.TriangleCount();
  double error = 0;
  try {
    if (origin == SurfaceOrigin::kUnknown) {
      if (absl::Status status = Check(surface, spacing); !status.ok()) return status;
    }
    if (level.max_error) {
      error = *level.max_error;
      SimplifyBy(error, spacing, origin, surface);
    } else if (exact > level.max_triangles.value_or(exact)) {
      error = SimplifyToCount(*level.max_triangles, spacing, origin, surface);
    }
  } catch (const Cancelled&) {
    return absl::CancelledError("the level of detail was cancelled");
  } catch (const TooMuchWork&) {
    return Unfit("too many triangles are large or overlap");
  }
  return surface.TriangleCount() < exact ? error : 0;
}

}  // namespace partiemc
