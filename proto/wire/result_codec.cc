// Encodes and decodes rings, mesh and statistics.
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "wire/bytes.h"
#include "wire/codec.h"
#include "wire/result_parts.h"
#include "wire/surface_codec.h"

namespace partiemc::wire {
namespace {

// The format of the points of rings and meshes.
PointFormat FormatOf(const v1::ReconstructedFrame& message) {
  return {.format = message.coordinate_format(), .origin = OriginOf(message), .components = 2};
}

void EncodeMeasures(const Rings& rings, v1::Rings& message) {
  auto& measures = *message.mutable_measures();
  Resize(measures, rings.measures.size());
  auto& identities = *message.mutable_identities();
  identities.resize(rings.measures.size() * sizeof(std::uint64_t));
  for (std::size_t k = 0; k < rings.measures.size(); ++k) {
    const RingMeasures& from = rings.measures[k];
    v1::RingMeasures& to = measures[static_cast<int>(k)];
    to.set_area(from.area);
    to.set_perimeter(from.perimeter);
    to.set_centroid_x(from.centroid_x);
    to.set_centroid_y(from.centroid_y);
    to.set_particle_count(from.particle_count);
    std::memcpy(identities.data() + k * sizeof(std::uint64_t), &from.identity,
                sizeof(std::uint64_t));
    const auto parents = rings.ParentsOf(k);
    to.mutable_parent_identities()->Assign(parents.begin(), parents.end());
  }
}

absl::Status EncodeRings(const Result& result, bool with_normals, v1::ReconstructedFrame& message) {
  v1::Rings& rings = *message.mutable_rings();
  AssignBytes(std::span<const std::uint32_t>(result.rings.offsets), *rings.mutable_offsets());
  AssignBytes(std::span<const std::uint32_t>(result.rings.outer_of), *rings.mutable_outer_of());
  AssignBytes(std::span<const std::uint32_t>(result.rings.cuts), *rings.mutable_cuts());
  AssignBytes(std::span<const std::uint32_t>(result.rings.wetted), *rings.mutable_wetted());
  AssignBytes(std::span<const std::uint32_t>(result.rings.contacts), *rings.mutable_contacts());
  AssignBytes(std::span<const float>(result.rings.contact_angles), *rings.mutable_contact_angles());
  EncodeMeasures(result.rings, rings);
  if (with_normals) {
    AssignBytes(std::span<const float>(result.rings.normals), *rings.mutable_normals());
  } else {
    rings.clear_normals();
  }
  EncodeAttributes(result.attributes, result.rings.PointCount(), *rings.mutable_attributes());
  return EncodePoints(result.rings.points, FormatOf(message), result.statistics.spacing,
                      "rings.points", *rings.mutable_points());
}

absl::Status EncodeMesh(const Result& result, v1::ReconstructedFrame& message) {
  v1::Mesh& mesh = *message.mutable_mesh();
  AssignBytes(std::span<const std::uint32_t>(result.mesh.triangles), *mesh.mutable_triangles());
  static_assert(sizeof(TriangleClass) == 1);
  AssignBytes(std::span<const TriangleClass>(result.mesh.classes), *mesh.mutable_classes());
  EncodeAttributes(result.attributes, result.mesh.PointCount(), *mesh.mutable_attributes());
  return EncodePoints(result.mesh.points, FormatOf(message), result.statistics.spacing,
                      "mesh.points", *mesh.mutable_points());
}

void EncodeStatistics(const FrameStatistics& statistics, v1::FrameStatistics& message) {
  message.set_particles(statistics.particles);
  message.set_tiles(statistics.tiles);
  message.set_active_cells(statistics.active_cells);
  message.set_dropped_holes(statistics.dropped_holes);
  message.set_dropped_components(statistics.dropped_components);
  message.set_dropped_spray(statistics.dropped_spray);
  message.set_cut_bodies(statistics.cut_bodies);
  message.set_triangles(statistics.triangles);
  message.set_triangles_grid(statistics.triangles_grid);
  message.set_self_intersections(statistics.self_intersections);
  message.set_folded_triangles(statistics.folded_triangles);
  message.set_area(statistics.area);
  message.set_perimeter(statistics.perimeter);
  message.set_volume(statistics.volume);
  message.set_spacing(statistics.spacing);
  message.set_cell_size(statistics.cell_size);
  message.clear_doubts();
  for (const Doubt doubt : kAllDoubts) {
    if (statistics.doubts.Has(doubt)) message.add_doubts(ToWire(doubt));
  }
}

void EncodeTimes(const FrameTimes& times, v1::FrameStatistics& message) {
  message.clear_stages();
  for (std::size_t stage = 0; stage < kStageCount; ++stage) {
    v1::StageTime& time = *message.add_stages();
    time.set_stage(kStageNames[stage].data(), kStageNames[stage].size());
    time.set_milliseconds(times.stages_ms[stage]);
  }
  message.set_milliseconds(times.total_ms);
}

absl::Status CheckOffsets(std::span<const std::uint32_t> offsets, std::size_t points) {
  if (offsets.empty()) {
    return points == 0 ? absl::OkStatus() : Lost("rings.offsets", "is empty, but there are points");
  }
  if (offsets.front() != 0 || offsets.back() != points) {
    return Lost("rings.offsets", absl::StrCat("must begin with 0 and end with the ", points,
                                              " points that there are"));
  }
  for (std::size_t k = 0; k + 1 < offsets.size(); ++k) {
    // Compares instead of subtracting, which could wrap around.
    if (offsets[k + 1] < offsets[k] || offsets[k + 1] - offsets[k] < 3) {
      return Lost("rings.offsets", absl::StrCat("gives ring ", k, " fewer than 3 points"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckNesting(std::span<const std::uint32_t> outer_of) {
  for (std::size_t k = 0; k < outer_of.size(); ++k) {
    const std::uint32_t outer = outer_of[k];
    if (outer == kNoRing) continue;
    if (outer >= outer_of.size() || outer_of[outer] != kNoRing) {
      return Lost("rings.outer_of",
                  absl::StrCat("names ring ", outer, " for ring ", k, ", which is no outer ring"));
    }
  }
  return absl::OkStatus();
}

// Decodes an ascending array of numbers of points.
absl::Status DecodeChosenPoints(absl::string_view field, const std::string& bytes,
                                std::size_t points, std::vector<std::uint32_t>& chosen) {
  if (bytes.size() % sizeof(std::uint32_t) != 0) return Lost(field, "is no array of uint32");
  CopyBytes(bytes, chosen);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    if (chosen[k] < points && (k == 0 || chosen[k - 1] < chosen[k])) continue;
    return Lost(field, absl::StrCat("must be ascending numbers of the ", points, " points"));
  }
  return absl::OkStatus();
}

absl::Status DecodeContacts(const v1::Rings& message, Rings& rings) {
  auto status =
      DecodeChosenPoints("rings.contacts", message.contacts(), rings.PointCount(), rings.contacts);
  if (!status.ok()) return status;
  if (message.contact_angles().size() != rings.contacts.size() * sizeof(float)) {
    return Lost("rings.contact_angles", absl::StrCat("must have a float for each of the ",
                                                     rings.contacts.size(), " contacts"));
  }
  CopyBytes(message.contact_angles(), rings.contact_angles);
  const auto is_finite = [](float angle) { return std::isfinite(angle); };
  if (std::ranges::all_of(rings.contact_angles, is_finite)) return absl::OkStatus();
  return Lost("rings.contact_angles", "must be finite");
}

// Checks the number of elements of every array against the numbers of rings and points.
absl::Status CheckRingCounts(const v1::Rings& message, std::size_t points) {
  if (message.offsets().size() % sizeof(std::uint32_t) != 0) {
    return Lost("rings.offsets", "is no array of uint32");
  }
  const std::size_t offsets = message.offsets().size() / sizeof(std::uint32_t);
  const std::size_t rings = offsets == 0 ? 0 : offsets - 1;
  const auto rule = [&](absl::string_view unit) {
    return absl::StrCat("must have ", unit, " for each of the ", rings, " rings");
  };
  if (message.outer_of().size() != rings * sizeof(std::uint32_t)) {
    return Lost("rings.outer_of", rule("a uint32"));
  }
  if (!message.identities().empty() &&
      message.identities().size() != rings * sizeof(std::uint64_t)) {
    return Lost("rings.identities", rule("a uint64"));
  }
  if (static_cast<std::size_t>(message.measures_size()) != rings) {
    return Lost("rings.measures", rule("an entry"));
  }
  if (!message.normals().empty() && message.normals().size() != points * 2 * sizeof(float)) {
    return Lost("rings.normals",
                absl::StrCat("must have two floats for each of the ", points, " points"));
  }
  return absl::OkStatus();
}

absl::Status DecodeRings(const v1::ReconstructedFrame& message, Rings& rings) {
  const v1::Rings& from = message.rings();
  if (auto status = DecodePoints(from.points(), FormatOf(message), "rings.points", rings.points);
      !status.ok()) {
    return status;
  }
  if (auto status = CheckRingCounts(from, rings.PointCount()); !status.ok()) return status;
  CopyBytes(from.offsets(), rings.offsets);
  if (auto status = CheckOffsets(rings.offsets, rings.PointCount()); !status.ok()) return status;
  // A result of the core has the first offset even if it has no rings.
  if (rings.offsets.empty()) rings.offsets.assign(1, 0);
  CopyBytes(from.outer_of(), rings.outer_of);
  if (auto status = CheckNesting(rings.outer_of); !status.ok()) return status;
  CopyBytes(from.normals(), rings.normals);
  const std::size_t points = rings.PointCount();
  auto status = DecodeChosenPoints("rings.cuts", from.cuts(), points, rings.cuts);
  if (!status.ok()) return status;
  status = DecodeChosenPoints("rings.wetted", from.wetted(), points, rings.wetted);
  if (!status.ok()) return status;
  if (status = DecodeContacts(from, rings); !status.ok()) return status;

  const auto identities = ViewBytes<std::uint64_t>(from.identities());
  rings.measures.resize(rings.RingCount());
  rings.parents.clear();
  rings.parent_offsets.assign(1, 0);
  for (std::size_t k = 0; k < rings.measures.size(); ++k) {
    const v1::RingMeasures& measures = from.measures(static_cast<int>(k));
    rings.measures[k] = {.area = measures.area(),
                         .perimeter = measures.perimeter(),
                         .centroid_x = measures.centroid_x(),
                         .centroid_y = measures.centroid_y(),
                         .particle_count = measures.particle_count(),
                         .identity = identities.empty() ? 0 : identities[k]};
    const auto& parents = measures.parent_identities();
    rings.parents.insert(rings.parents.end(), parents.begin(), parents.end());
    rings.parent_offsets.push_back(static_cast<std::uint32_t>(rings.parents.size()));
  }
  return absl::OkStatus();
}

absl::Status DecodeMesh(const v1::ReconstructedFrame& message, Mesh& mesh) {
  const v1::Mesh& from = message.mesh();
  if (auto status = DecodePoints(from.points(), FormatOf(message), "mesh.points", mesh.points);
      !status.ok()) {
    return status;
  }
  if (from.triangles().size() != from.classes().size() * 3 * sizeof(std::uint32_t)) {
    return Lost("mesh.triangles", absl::StrCat("must have three uint32 for each of the ",
                                               from.classes().size(), " triangles"));
  }
  CopyBytes(from.triangles(), mesh.triangles);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (mesh.triangles[i] >= mesh.PointCount()) {
      return Lost("mesh.triangles",
                  absl::StrCat("names point ", mesh.triangles[i], " of ", mesh.PointCount()));
    }
  }
  for (const char value : from.classes()) {
    if (value != static_cast<char>(TriangleClass::kBoundary) &&
        value != static_cast<char>(TriangleClass::kInterior)) {
      return Lost("mesh.classes", "has a class other than 0 and 1");
    }
  }
  CopyBytes(from.classes(), mesh.classes);
  return absl::OkStatus();
}

void DecodeStatistics(const v1::FrameStatistics& message, FrameStatistics& statistics) {
  statistics = {.particles = message.particles(),
                .tiles = message.tiles(),
                .active_cells = message.active_cells(),
                .dropped_holes = message.dropped_holes(),
                .dropped_components = message.dropped_components(),
                .dropped_spray = message.dropped_spray(),
                .cut_bodies = message.cut_bodies(),
                .triangles = message.triangles(),
                .triangles_grid = message.triangles_grid(),
                .self_intersections = message.self_intersections(),
                .folded_triangles = message.folded_triangles(),
                .area = message.area(),
                .perimeter = message.perimeter(),
                .volume = message.volume(),
                .spacing = message.spacing(),
                .cell_size = message.cell_size()};
  // A newer server may send doubts that are unknown here.
  for (const Doubt doubt : kAllDoubts) {
    if (std::count(message.doubts().begin(), message.doubts().end(), ToWire(doubt)) > 0) {
      statistics.doubts.Add(doubt);
    }
  }
}

void DecodeTimes(const v1::FrameStatistics& message, FrameTimes& times) {
  times = {};
  times.total_ms = message.milliseconds();
  for (const v1::StageTime& time : message.stages()) {
    // A newer server may send stages that are unknown here.
    const auto name = std::find(kStageNames.begin(), kStageNames.end(), time.stage());
    if (name == kStageNames.end()) continue;
    times.stages_ms[static_cast<std::size_t>(name - kStageNames.begin())] = time.milliseconds();
  }
}

absl::Status DecodeGeometry(const v1::ReconstructedFrame& message, Result& result) {
  if (!v1::CoordinateFormat_IsValid(message.coordinate_format())) {
    return Lost("coordinate_format",
                absl::StrCat("is ", message.coordinate_format(), ", which this client knows not"));
  }
  if (auto status = DecodeRings(message, result.rings); !status.ok()) return status;
  if (auto status = DecodeMesh(message, result.mesh); !status.ok()) return status;
  const std::size_t rings = result.rings.PointCount(), mesh = result.mesh.PointCount();
  if (auto status = CheckAttributes("rings", message.rings().attributes(), rings); !status.ok()) {
    return status;
  }
  if (auto status = CheckAttributes("mesh", message.mesh().attributes(), mesh); !status.ok()) {
    return status;
  }
  DecodeAttributes(mesh > 0 ? message.mesh().attributes() : message.rings().attributes(),
                   result.attributes);
  return absl::OkStatus();
}

absl::Status EncodeOutline(const Result& result, const Outputs& outputs,
                           v1::ReconstructedFrame& message) {
  const std::span<const double> points[] = {result.rings.points, result.mesh.points};
  const bool relative = outputs.coordinates != Coordinates::kFloat64;
  SetOrigin(relative ? MiddleOf(points, 2) : Origin{}, message);
  message.set_coordinate_format(relative ? v1::COORDINATE_FORMAT_FLOAT32_RELATIVE
                                         : v1::COORDINATE_FORMAT_FLOAT64);
  // Overwrites the messages of rings and mesh, so that their buffers are reused.
  if (!outputs.rings) message.clear_rings();
  if (!outputs.mesh) message.clear_mesh();
  absl::Status status;
  if (outputs.rings) status = EncodeRings(result, outputs.normals, message);
  if (status.ok() && outputs.mesh) status = EncodeMesh(result, message);
  return status;
}

// Encodes the result of a frame or of a section, except for times and sections. It has a surface or
// an outline.
absl::Status EncodeShape(const Result& result, const Outputs& outputs,
                         v1::ReconstructedFrame& message) {
  EncodeStatistics(result.statistics, *message.mutable_statistics());
  message.set_rings_digest(DigestRings(result.rings));
  message.set_mesh_digest(DigestMesh(result.mesh));
  message.set_surface_digest(DigestSurface(result.surface));
  // A result has a surface if the surface has shells or attributes: without shells, it still sends
  // the names of its attributes. Otherwise the result is an outline.
  if (result.surface.ShellCount() == 0 && result.surface.attributes.empty()) {
    message.clear_surface();
    return EncodeOutline(result, outputs, message);
  }
  message.clear_rings();
  message.clear_mesh();
  if (outputs.surface) return EncodeSurface(result, outputs, message);
  message.clear_surface();
  return absl::OkStatus();
}

absl::Status DecodeShape(const v1::ReconstructedFrame& message, Result& result) {
  DecodeStatistics(message.statistics(), result.statistics);
  auto status = DecodeGeometry(message, result);
  if (status.ok()) status = DecodeSurface(message, result.surface);
  if (!status.ok() || !message.has_surface()) return status;
  if (result.rings.PointCount() > 0 || result.mesh.PointCount() > 0) {
    return Lost("surface", "must come without rings and mesh");
  }
  const FrameStatistics& statistics = result.statistics;
  result.surface.statistics = {.dropped_cavities = statistics.dropped_holes,
                               .dropped_components = statistics.dropped_components,
                               .dropped_spray = statistics.dropped_spray,
                               .bricks = statistics.tiles,
                               .doubts = statistics.doubts};
  return status;
}

}  // namespace

v1::Doubt ToWire(Doubt doubt) {
  switch (doubt) {
    case Doubt::kSpacingProvisional:
      return v1::DOUBT_SPACING_PROVISIONAL;
    case Doubt::kSpacingContradicted:
      return v1::DOUBT_SPACING_CONTRADICTED;
    case Doubt::kVolumesContradictSpacing:
      return v1::DOUBT_VOLUMES_CONTRADICT_SPACING;
    case Doubt::kPositionsCoarse:
      return v1::DOUBT_POSITIONS_COARSE;
    case Doubt::kWallsHideFluid:
      return v1::DOUBT_WALLS_HIDE_FLUID;
  }
  return v1::DOUBT_UNSPECIFIED;
}

absl::Status EncodeResult(const Result& result, const FrameTimes& times, const Outputs& outputs,
                          v1::ReconstructedFrame& message) {
  EncodeTimes(times, *message.mutable_statistics());
  absl::Status status = EncodeShape(result, outputs, message);
  const int sections = static_cast<int>(result.sections.size());
  Resize(*message.mutable_sections(), result.sections.size());
  for (int k = 0; status.ok() && k < sections; ++k) {
    status = EncodeShape(result.sections[static_cast<std::size_t>(k)], outputs,
                         *message.mutable_sections(k));
  }
  if (!status.ok()) {
    message.clear_rings();
    message.clear_mesh();
    message.clear_surface();
    message.clear_sections();
  }
  return status;
}

absl::Status DecodeResult(const v1::ReconstructedFrame& message, ReconstructedFrame& frame) {
  frame.sequence = message.sequence();
  frame.time = message.time();
  DecodeTimes(message.statistics(), frame.times);
  frame.rings_digest = message.rings_digest();
  frame.mesh_digest = message.mesh_digest();
  frame.surface_digest = message.surface_digest();
  absl::Status status = DecodeShape(message, frame.result);
  frame.result.sections.resize(static_cast<std::size_t>(message.sections_size()));
  frame.section_digests.clear();
  for (int k = 0; status.ok() && k < message.sections_size(); ++k) {
    const v1::ReconstructedFrame& section = message.sections(k);
    status = DecodeShape(section, frame.result.sections[static_cast<std::size_t>(k)]);
    frame.section_digests.push_back({section.rings_digest(), section.mesh_digest()});
  }
  if (!status.ok()) {
    frame.result.Clear();
    frame.result.attributes.clear();
    frame.result.surface.attributes.clear();
    frame.result.sections.clear();
    frame.section_digests.clear();
  }
  return status;
}

}  // namespace partiemc::wire
