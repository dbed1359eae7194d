// Encodes and decodes rings, mesh and statistics.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "partiemc/status.h"
#include "wire/bytes.h"
#include "wire/codec.h"

namespace partiemc::wire {
namespace {

// Largest error of relative coordinates, in spacings: a hundredth of the accuracy of the outline.
constexpr double kMaxRelativeShift = 1e-4;

struct Point {
  double x = 0, y = 0;
};

// The centre of the bounding box minimises the largest relative coordinate.
Point MiddleOf(const Result& result) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Point low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
  const auto include = [&](std::span<const double> points) {
    for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
      low = {std::min(low.x, points[i]), std::min(low.y, points[i + 1])};
      high = {std::max(high.x, points[i]), std::max(high.y, points[i + 1])};
    }
  };
  include(result.rings.points);
  include(result.mesh.points);
  if (low.x > high.x) return {};
  return {low.x + (high.x - low.x) / 2, low.y + (high.y - low.y) / 2};
}

absl::Status AssignRelative(std::span<const double> points, Point origin, double spacing,
                            absl::string_view field, std::string& bytes) {
  bytes.resize(points.size() * sizeof(float));
  const double limit = kMaxRelativeShift * spacing;
  for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
    const auto x = static_cast<float>(points[i] - origin.x);
    const auto y = static_cast<float>(points[i + 1] - origin.y);
    std::memcpy(bytes.data() + i * sizeof(float), &x, sizeof(float));
    std::memcpy(bytes.data() + (i + 1) * sizeof(float), &y, sizeof(float));
    const double shift = std::hypot(origin.x + x - points[i], origin.y + y - points[i + 1]);
    // This form of the comparison refuses NaN, too.
    if (shift <= limit) continue;
    return ViolationError(absl::StatusCode::kOutOfRange,
                          {std::string(kReasonResolution), absl::StrCat(field, "[", i / 2, "]"),
                           absl::StrCat("moved by ", ShortestNumber(shift / spacing), " spacings"),
                           absl::StrCat("must move by at most ", ShortestNumber(kMaxRelativeShift),
                                        " spacings; ask for COORDINATE_FORMAT_FLOAT64")});
  }
  return absl::OkStatus();
}

absl::Status EncodePoints(std::span<const double> points, const v1::ReconstructedFrame& message,
                          double spacing, absl::string_view field, std::string& bytes) {
  if (message.coordinate_format() == v1::COORDINATE_FORMAT_FLOAT32_RELATIVE) {
    return AssignRelative(points, {message.origin_x(), message.origin_y()}, spacing, field, bytes);
  }
  AssignBytes(points, bytes);
  return absl::OkStatus();
}

void EncodeMeasures(const Rings& rings, v1::Rings& message) {
  auto& measures = *message.mutable_measures();
  // Clear() would free the elements that are overwritten below.
  while (measures.size() > static_cast<int>(rings.measures.size())) measures.RemoveLast();
  while (measures.size() < static_cast<int>(rings.measures.size())) measures.Add();
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

using NamedAttributes = google::protobuf::RepeatedPtrField<v1::NamedAttribute>;

// Writes the attributes of the first `points` vertices.
void EncodeAttributes(std::span<const AttributeValues> attributes, std::size_t points,
                      NamedAttributes& messages) {
  while (messages.size() > static_cast<int>(attributes.size())) messages.RemoveLast();
  while (messages.size() < static_cast<int>(attributes.size())) messages.Add();
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const AttributeValues& from = attributes[k];
    v1::NamedAttribute& to = messages[static_cast<int>(k)];
    to.set_name(from.name);
    to.set_components(static_cast<std::uint32_t>(from.components));
    // An empty frame has none.
    AssignBytes(
        std::span(from.values).first(std::min(from.values.size(), points * from.components)),
        *to.mutable_values());
  }
}

absl::Status EncodeRings(const Result& result, bool with_normals, v1::ReconstructedFrame& message) {
  v1::Rings& rings = *message.mutable_rings();
  AssignBytes(std::span<const std::uint32_t>(result.rings.offsets), *rings.mutable_offsets());
  AssignBytes(std::span<const std::uint32_t>(result.rings.outer_of), *rings.mutable_outer_of());
  EncodeMeasures(result.rings, rings);
  if (with_normals) {
    AssignBytes(std::span<const float>(result.rings.normals), *rings.mutable_normals());
  } else {
    rings.clear_normals();
  }
  EncodeAttributes(result.attributes, result.rings.PointCount(), *rings.mutable_attributes());
  return EncodePoints(result.rings.points, message, result.statistics.spacing, "rings.points",
                      *rings.mutable_points());
}

absl::Status EncodeMesh(const Result& result, v1::ReconstructedFrame& message) {
  v1::Mesh& mesh = *message.mutable_mesh();
  AssignBytes(std::span<const std::uint32_t>(result.mesh.triangles), *mesh.mutable_triangles());
  static_assert(sizeof(TriangleClass) == 1);
  AssignBytes(std::span<const TriangleClass>(result.mesh.classes), *mesh.mutable_classes());
  EncodeAttributes(result.attributes, result.mesh.PointCount(), *mesh.mutable_attributes());
  return EncodePoints(result.mesh.points, message, result.statistics.spacing, "mesh.points",
                      *mesh.mutable_points());
}

void EncodeStatistics(const FrameStatistics& statistics, v1::FrameStatistics& message) {
  message.set_particles(statistics.particles);
  message.set_tiles(statistics.tiles);
  message.set_active_cells(statistics.active_cells);
  message.set_dropped_holes(statistics.dropped_holes);
  message.set_dropped_components(statistics.dropped_components);
  message.set_dropped_spray(statistics.dropped_spray);
  message.set_triangles(statistics.triangles);
  message.set_triangles_grid(statistics.triangles_grid);
  message.set_self_intersections(statistics.self_intersections);
  message.set_folded_triangles(statistics.folded_triangles);
  message.set_area(statistics.area);
  message.set_perimeter(statistics.perimeter);
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

absl::Status Lost(absl::string_view field, absl::string_view rule) {
  return absl::DataLossError(absl::StrCat(field, " of the server's answer ", rule));
}

absl::Status DecodePoints(const v1::ReconstructedFrame& message, const std::string& bytes,
                          absl::string_view field, std::vector<double>& points) {
  const bool relative = message.coordinate_format() == v1::COORDINATE_FORMAT_FLOAT32_RELATIVE;
  const std::size_t point_bytes = 2 * (relative ? sizeof(float) : sizeof(double));
  if (bytes.size() % point_bytes != 0) {
    return Lost(
        field, absl::StrCat("has ", bytes.size(), " bytes, which is no multiple of ", point_bytes));
  }
  if (relative) {
    const auto values = ViewBytes<float>(bytes);
    points.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      points[i] = (i % 2 == 0 ? message.origin_x() : message.origin_y()) + double{values[i]};
    }
  } else {
    CopyBytes(bytes, points);
  }
  if (!std::all_of(points.begin(), points.end(), [](double v) { return std::isfinite(v); })) {
    return Lost(field, "has a coordinate that is not finite");
  }
  return absl::OkStatus();
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
  if (auto status = DecodePoints(message, from.points(), "rings.points", rings.points);
      !status.ok()) {
    return status;
  }
  if (auto status = CheckRingCounts(from, rings.PointCount()); !status.ok()) return status;
  CopyBytes(from.offsets(), rings.offsets);
  if (auto status = CheckOffsets(rings.offsets, rings.PointCount()); !status.ok()) return status;
  CopyBytes(from.outer_of(), rings.outer_of);
  if (auto status = CheckNesting(rings.outer_of); !status.ok()) return status;
  CopyBytes(from.normals(), rings.normals);

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
  if (auto status = DecodePoints(message, from.points(), "mesh.points", mesh.points);
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

absl::Status CheckAttributes(absl::string_view of, const NamedAttributes& messages,
                             std::size_t points) {
  for (int k = 0; k < messages.size(); ++k) {
    const std::uint64_t components = messages[k].components();
    if (components < 1 || components > 3 ||
        messages[k].values().size() != points * components * sizeof(float)) {
      return Lost(absl::StrCat(of, ".attributes[", k, "]"),
                  absl::StrCat("must have 1 to 3 floats for each of the ", points, " points"));
    }
  }
  return absl::OkStatus();
}

void DecodeAttributes(const NamedAttributes& messages, std::vector<AttributeValues>& attributes) {
  attributes.resize(static_cast<std::size_t>(messages.size()));
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    const v1::NamedAttribute& from = messages[static_cast<int>(k)];
    attributes[k].name = from.name();
    attributes[k].components = static_cast<int>(from.components());
    CopyBytes(from.values(), attributes[k].values);
  }
}

void DecodeStatistics(const v1::FrameStatistics& message, FrameStatistics& statistics) {
  statistics = {.particles = message.particles(),
                .tiles = message.tiles(),
                .active_cells = message.active_cells(),
                .dropped_holes = message.dropped_holes(),
                .dropped_components = message.dropped_components(),
                .dropped_spray = message.dropped_spray(),
                .triangles = message.triangles(),
                .triangles_grid = message.triangles_grid(),
                .self_intersections = message.self_intersections(),
                .folded_triangles = message.folded_triangles(),
                .area = message.area(),
                .perimeter = message.perimeter(),
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

// Decodes an outline, except for times and sections.
absl::Status EncodeOutline(const Result& result, const Outputs& outputs,
                           v1::ReconstructedFrame& message) {
  EncodeStatistics(result.statistics, *message.mutable_statistics());
  message.set_rings_digest(DigestRings(result.rings));
  message.set_mesh_digest(DigestMesh(result.mesh));
  const Point origin = outputs.relative_float32 ? MiddleOf(result) : Point{};
  message.set_coordinate_format(outputs.relative_float32 ? v1::COORDINATE_FORMAT_FLOAT32_RELATIVE
                                                         : v1::COORDINATE_FORMAT_FLOAT64);
  message.set_origin_x(origin.x);
  message.set_origin_y(origin.y);
  // Overwrites the messages of rings and mesh, so that their buffers are reused.
  if (!outputs.rings) message.clear_rings();
  if (!outputs.mesh) message.clear_mesh();
  absl::Status status;
  if (outputs.rings) status = EncodeRings(result, outputs.normals, message);
  if (status.ok() && outputs.mesh) status = EncodeMesh(result, message);
  return status;
}

absl::Status DecodeOutline(const v1::ReconstructedFrame& message, Result& result) {
  DecodeStatistics(message.statistics(), result.statistics);
  return DecodeGeometry(message, result);
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
  }
  return v1::DOUBT_UNSPECIFIED;
}

absl::Status EncodeResult(const Result& result, const FrameTimes& times, const Outputs& outputs,
                          v1::ReconstructedFrame& message) {
  EncodeTimes(times, *message.mutable_statistics());
  absl::Status status = EncodeOutline(result, outputs, message);
  const int sections = static_cast<int>(result.sections.size());
  // Existing elements keep their buffers.
  while (message.sections_size() > sections) message.mutable_sections()->RemoveLast();
  while (message.sections_size() < sections) message.add_sections();
  for (int k = 0; status.ok() && k < sections; ++k) {
    status = EncodeOutline(result.sections[static_cast<std::size_t>(k)], outputs,
                           *message.mutable_sections(k));
  }
  if (!status.ok()) {
    message.clear_rings();
    message.clear_mesh();
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
  absl::Status status = DecodeOutline(message, frame.result);
  frame.result.sections.resize(static_cast<std::size_t>(message.sections_size()));
  frame.section_digests.clear();
  for (int k = 0; status.ok() && k < message.sections_size(); ++k) {
    const v1::ReconstructedFrame& section = message.sections(k);
    status = DecodeOutline(section, frame.result.sections[static_cast<std::size_t>(k)]);
    frame.section_digests.push_back({section.rings_digest(), section.mesh_digest()});
  }
  if (!status.ok()) {
    frame.result.Clear();
    frame.result.attributes.clear();
    frame.result.sections.clear();
    frame.section_digests.clear();
  }
  return status;
}

}  // namespace partiemc::wire
