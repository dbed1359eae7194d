#include "wire/surface_codec.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "wire/bytes.h"
#include "wire/compact_surface.h"
#include "wire/result_parts.h"

namespace partiemc::wire {
namespace {

// A shell has at least four triangles, a tetrahedron.
constexpr std::uint32_t kFewestOfShell = 4;

void EncodeMeasures(const Surface& surface, v1::Surface& message) {
  auto& measures = *message.mutable_measures();
  Resize(measures, surface.measures.size());
  std::string& identities = *message.mutable_identities();
  identities.resize(surface.measures.size() * sizeof(std::uint64_t));
  for (std::size_t k = 0; k < surface.measures.size(); ++k) {
    const ShellMeasures& from = surface.measures[k];
    v1::ShellMeasures& to = measures[static_cast<int>(k)];
    to.set_area(from.area);
    to.set_volume(from.volume);
    to.set_centroid_x(from.centroid_x);
    to.set_centroid_y(from.centroid_y);
    to.set_centroid_z(from.centroid_z);
    to.set_particle_count(from.particles);
    std::memcpy(identities.data() + k * sizeof(std::uint64_t), &from.identity,
                sizeof(std::uint64_t));
    const auto parents = surface.ParentsOf(k);
    to.mutable_parent_identities()->Assign(parents.begin(), parents.end());
  }
}

void DecodeMeasures(const v1::Surface& message, Surface& surface) {
  const auto identities = ViewBytes<std::uint64_t>(message.identities());
  surface.measures.resize(surface.ShellCount());
  surface.parents.clear();
  surface.parent_offsets.assign(1, 0);
  for (std::size_t k = 0; k < surface.measures.size(); ++k) {
    const v1::ShellMeasures& from = message.measures(static_cast<int>(k));
    surface.measures[k] = {.area = from.area(),
                           .volume = from.volume(),
                           .centroid_x = from.centroid_x(),
                           .centroid_y = from.centroid_y(),
                           .centroid_z = from.centroid_z(),
                           .particles = from.particle_count(),
                           .identity = identities.empty() ? 0 : identities[k]};
    const auto& parents = from.parent_identities();
    surface.parents.insert(surface.parents.end(), parents.begin(), parents.end());
    surface.parent_offsets.push_back(static_cast<std::uint32_t>(surface.parents.size()));
  }
}

absl::Status DecodeOffsets(const std::string& bytes, absl::string_view field,
                           std::vector<std::uint32_t>& offsets) {
  if (bytes.size() % sizeof(std::uint32_t) != 0) return Lost(field, "is no array of uint32");
  CopyBytes(bytes, offsets);
  if (offsets.empty() || offsets.front() != 0) return Lost(field, "must begin with 0");
  for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
    // Compares instead of subtracting, which could wrap around.
    if (offsets[k + 1] < offsets[k] || offsets[k + 1] - offsets[k] < kFewestOfShell) {
      return Lost(field, absl::StrCat("gives shell ", k, " fewer than ", kFewestOfShell));
    }
  }
  return absl::OkStatus();
}

// Reads offsets and nesting, and checks the sizes of the arrays with an entry for each shell.
absl::Status DecodeShells(const v1::Surface& message, Surface& surface) {
  auto status =
      DecodeOffsets(message.point_offsets(), "surface.point_offsets", surface.point_offsets);
  if (!status.ok()) return status;
  status = DecodeOffsets(message.triangle_offsets(), "surface.triangle_offsets",
                         surface.triangle_offsets);
  if (!status.ok()) return status;
  const std::size_t shells = surface.point_offsets.size() - 1;
  const auto rule = [&](absl::string_view unit) {
    return absl::StrCat("must have ", unit, " for each of the ", shells, " shells");
  };
  if (surface.triangle_offsets.size() != shells + 1) {
    return Lost("surface.triangle_offsets", rule("an entry"));
  }
  if (message.outer_of().size() != shells * sizeof(std::uint32_t)) {
    return Lost("surface.outer_of", rule("a uint32"));
  }
  if (!message.identities().empty() &&
      message.identities().size() != shells * sizeof(std::uint64_t)) {
    return Lost("surface.identities", rule("a uint64"));
  }
  if (static_cast<std::size_t>(message.measures_size()) != shells) {
    return Lost("surface.measures", rule("an entry"));
  }
  CopyBytes(message.outer_of(), surface.outer_of);
  for (std::size_t k = 0; k < shells; ++k) {
    const std::uint32_t outer = surface.outer_of[k];
    if (outer == kNoShell || (outer < shells && surface.outer_of[outer] == kNoShell)) continue;
    return Lost("surface.outer_of",
                absl::StrCat("names shell ", outer, " for shell ", k, ", which is no outer shell"));
  }
  return absl::OkStatus();
}

// Checks that the triangles of each shell use only points of this shell.
absl::Status CheckTriangles(const Surface& surface) {
  for (std::size_t k = 0; k < surface.ShellCount(); ++k) {
    const std::uint32_t first = surface.point_offsets[k], end = surface.point_offsets[k + 1];
    for (std::size_t i = 3 * std::size_t{surface.triangle_offsets[k]};
         i < 3 * std::size_t{surface.triangle_offsets[k + 1]}; ++i) {
      if (const std::uint32_t point = surface.triangles[i]; point < first || point >= end) {
        return Lost("surface.triangles",
                    absl::StrCat("names point ", point, " for shell ", k, ", which has the points ",
                                 first, " to ", end - 1));
      }
    }
  }
  return absl::OkStatus();
}

absl::Status DecodePlain(const v1::Surface& message, const PointFormat& format, Surface& surface) {
  auto status = DecodePoints(message.points(), format, "surface.points", surface.points);
  if (!status.ok()) return status;
  const std::size_t points = surface.point_offsets.back();
  const std::size_t triangles = surface.triangle_offsets.back();
  if (surface.PointCount() != points) {
    return Lost("surface.points", absl::StrCat("must be ", points, " points, as the offsets say"));
  }
  if (message.triangles().size() != 3 * sizeof(std::uint32_t) * triangles) {
    return Lost("surface.triangles",
                absl::StrCat("must have three uint32 for each of the ", triangles, " triangles"));
  }
  CopyBytes(message.triangles(), surface.triangles);
  if (!message.normals().empty() && message.normals().size() != 3 * sizeof(float) * points) {
    return Lost("surface.normals",
                absl::StrCat("must have three floats for each of the ", points, " points"));
  }
  CopyBytes(message.normals(), surface.normals);
  status = CheckAttributes("surface", message.attributes(), points);
  if (!status.ok()) return status;
  DecodeAttributes(message.attributes(), surface.attributes);
  return absl::OkStatus();
}

absl::Status DecodeCuts(const v1::Surface& message, Surface& surface) {
  constexpr absl::string_view kField = "surface.cuts";
  if (message.cuts().size() % sizeof(std::uint32_t) != 0) {
    return Lost(kField, "is no array of uint32");
  }
  CopyBytes(message.cuts(), surface.cuts);
  for (std::size_t k = 0; k < surface.cuts.size(); ++k) {
    const bool ascends = k == 0 || surface.cuts[k - 1] < surface.cuts[k];
    if (surface.cuts[k] < surface.TriangleCount() && ascends) continue;
    return Lost(kField, absl::StrCat("must be ascending numbers of the ", surface.TriangleCount(),
                                     " triangles"));
  }
  return absl::OkStatus();
}

// Writes offsets, points, triangles, cuts, normals and attributes, in the coordinate format and
// relative to the origin of `message`.
absl::Status EncodeGeometry(const Surface& surface, double spacing, bool has_normals,
                            v1::ReconstructedFrame& message) {
  v1::Surface& to = *message.mutable_surface();
  AssignBytes(std::span<const std::uint32_t>(surface.point_offsets), *to.mutable_point_offsets());
  AssignBytes(std::span<const std::uint32_t>(surface.triangle_offsets),
              *to.mutable_triangle_offsets());
  const Origin origin = OriginOf(message);
  if (message.coordinate_format() == v1::COORDINATE_FORMAT_COMPACT) {
    return EncodeCompact(surface, origin, spacing, has_normals && !surface.normals.empty(), to);
  }
  to.clear_step();
  AssignBytes(std::span<const std::uint32_t>(surface.cuts), *to.mutable_cuts());
  AssignBytes(std::span<const std::uint32_t>(surface.triangles), *to.mutable_triangles());
  if (has_normals) {
    AssignBytes(std::span<const float>(surface.normals), *to.mutable_normals());
  } else {
    to.clear_normals();
  }
  EncodeAttributes(surface.attributes, surface.PointCount(), *to.mutable_attributes());
  return EncodePoints(surface.points,
                      {.format = message.coordinate_format(), .origin = origin, .components = 3},
                      spacing, "surface.points", *to.mutable_points());
}

}  // namespace

absl::Status EncodeSurface(const Result& result, const Outputs& outputs,
                           v1::ReconstructedFrame& message) {
  const Surface& surface = result.surface;
  const std::span<const double> points = surface.points;
  Origin origin{};
  if (outputs.coordinates != Coordinates::kFloat64) origin = MiddleOf({&points, 1}, 3);
  SetOrigin(origin, message);
  message.set_coordinate_format(ToWire(outputs.coordinates));
  v1::Surface& to = *message.mutable_surface();
  AssignBytes(std::span<const std::uint32_t>(surface.outer_of), *to.mutable_outer_of());
  EncodeMeasures(surface, to);
  return EncodeGeometry(surface, result.statistics.spacing, outputs.normals, message);
}

absl::Status ReplaceGeometry(const Surface& surface, double spacing,
                             v1::ReconstructedFrame& message) {
  return EncodeGeometry(surface, spacing, !surface.normals.empty(), message);
}

absl::Status DecodeSurface(const v1::ReconstructedFrame& message, Surface& surface) {
  surface.Clear();
  if (!message.has_surface()) {
    surface.attributes.clear();
    return absl::OkStatus();
  }
  const v1::Surface& from = message.surface();
  auto status = DecodeShells(from, surface);
  if (!status.ok()) return status;
  const Origin origin = OriginOf(message);
  if (!std::all_of(origin.begin(), origin.end(), [](double v) { return std::isfinite(v); })) {
    return Lost("origin", "has a coordinate that is not finite");
  }
  status =
      message.coordinate_format() == v1::COORDINATE_FORMAT_COMPACT
          ? DecodeCompact(from, origin, surface)
          : DecodePlain(from,
                        {.format = message.coordinate_format(), .origin = origin, .components = 3},
                        surface);
  if (status.ok()) status = CheckTriangles(surface);
  if (status.ok()) status = DecodeCuts(from, surface);
  if (!status.ok()) return status;
  DecodeMeasures(from, surface);
  return absl::OkStatus();
}

}  // namespace partiemc::wire
