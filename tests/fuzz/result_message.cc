// A server's response as decoded by the client: any accepted response is consistent. As decoded by
// another replica: any level of detail is consistent, too.
#include <cmath>

#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "fuzz/targets.h"
#include "partiemc/partiemc.h"
#include "wire/codec.h"
#include "wire/message_bytes.h"
#include "wire/surface_level.h"

namespace partiemc::fuzz {
namespace {

// Checks all arrays that writers and callers index by.
void RequireWhole(const Result& result) {
  const Rings& rings = result.rings;
  Require(rings.offsets.size() == rings.RingCount() + 1 || rings.RingCount() == 0,
          "a ring has a beginning and an end");
  Require(rings.measures.size() == rings.RingCount(), "a ring has measures");
  for (std::size_t k = 0; k < rings.RingCount(); ++k) {
    Require(rings.offsets[k] < rings.offsets[k + 1] && rings.offsets[k + 1] <= rings.PointCount(),
            "a ring's points are there");
    const std::uint32_t outer = rings.outer_of[k];
    Require(outer == kNoRing || (outer < rings.RingCount() && rings.outer_of[outer] == kNoRing),
            "a hole's outer ring is one");
    rings.ParentsOf(k);
  }
  Require(rings.normals.empty() || rings.normals.size() == rings.points.size(),
          "normals are there for every point, or none");
  Require(result.mesh.triangles.size() == 3 * result.mesh.TriangleCount(),
          "a triangle has three points and a class");
  for (const std::uint32_t point : result.mesh.triangles) {
    Require(point < result.mesh.PointCount(), "a triangle's points are there");
  }
  for (const TriangleClass of_triangle : result.mesh.classes) {
    Require(of_triangle == TriangleClass::kBoundary || of_triangle == TriangleClass::kInterior,
            "a triangle's class is known");
  }
  const Surface& surface = result.surface;
  Require(surface.point_offsets.back() == surface.PointCount() &&
              surface.triangle_offsets.back() == surface.TriangleCount() &&
              surface.point_offsets.size() == surface.ShellCount() + 1 &&
              surface.triangle_offsets.size() == surface.ShellCount() + 1 &&
              surface.measures.size() == surface.ShellCount(),
          "shells have their points, triangles and measures");
  for (const std::uint32_t point : surface.triangles) {
    Require(point < surface.PointCount(), "a triangle's points are there");
  }
  Require(surface.normals.empty() || surface.normals.size() == surface.points.size(),
          "normals are there for every point, or none");
  for (const double coordinate : surface.points) {
    Require(std::isfinite(coordinate), "finite points");
  }
  for (const double coordinate : rings.points) Require(std::isfinite(coordinate), "finite points");
  for (const double coordinate : result.mesh.points) {
    Require(std::isfinite(coordinate), "finite points");
  }
}

// A server makes levels of the messages of other replicas.
void RequireLevel(const v1::ReconstructedFrame& message, const LevelOfDetail& level) {
  v1::ReconstructedFrame made = message;
  const auto grant = [](std::uint64_t) { return absl::OkStatus(); };
  const absl::Status status =
      wire::ReplaceByLevel(level, SurfaceOrigin::kUnknown, grant, nullptr, made);
  if (!status.ok()) {
    return Require(absl::IsDataLoss(status) || absl::IsOutOfRange(status),
                   "a level that cannot be made is DATA_LOSS, or too fine");
  }
  if (!message.has_surface()) return;
  wire::ReconstructedFrame exact, coarse;
  if (!wire::DecodeResult(message, exact).ok()) return;
  RequireOk(wire::DecodeResult(made, coarse), "a level can be decoded");
  const Surface &from = exact.result.surface, &to = coarse.result.surface;
  Require(to.outer_of == from.outer_of && to.measures.size() == from.measures.size() &&
              to.TriangleCount() <= from.TriangleCount(),
          "a level has the shells of the surface, and no more triangles");
}

}  // namespace

void AttackResultMessage(Bytes bytes) {
  const SingleThread single_thread;
  v1::ReconstructedFrame message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  Require(message.SpaceUsedLong() <=
              bytes.size() +
                  wire::ParsedBytes({reinterpret_cast<const char*>(bytes.data()), bytes.size()},
                                    *v1::ReconstructedFrame::descriptor()),
          "the memory of a parsed message is bounded");
  RequireLevel(message, {.max_error = .1, .max_triangles = {}});
  RequireLevel(message, {.max_error = {}, .max_triangles = 8});
  wire::ReconstructedFrame frame;
  const absl::Status status = wire::DecodeResult(message, frame);
  if (!status.ok()) {
    Require(absl::IsDataLoss(status), "a broken answer is DATA_LOSS");
    Require(frame.result.rings.points.empty() && frame.result.mesh.points.empty() &&
                frame.result.surface == Surface{},
            "a broken answer leaves nothing");
    return;
  }
  RequireWhole(frame.result);
  // --check and the writers must not rely on a benign server.
  if (Validate(frame.result).ok()) CountTJunctions(frame.result);
  (void)Validate(frame.result.surface);
  v1::ReconstructedFrame again;
  RequireOk(wire::EncodeResult(frame.result, frame.times, {.normals = true}, again),
            "what was decoded can be encoded");
  wire::ReconstructedFrame twice;
  RequireOk(wire::DecodeResult(again, twice), "and decoded again");
  Require(DigestRings(frame.result.rings) == DigestRings(twice.result.rings) &&
              DigestMesh(frame.result.mesh) == DigestMesh(twice.result.mesh) &&
              DigestSurface(frame.result.surface) == DigestSurface(twice.result.surface),
          "to the same bits");
}

}  // namespace partiemc::fuzz
