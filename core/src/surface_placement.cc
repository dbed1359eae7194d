#include "surface_placement.h"

#include <cstddef>
#include <span>

#include "base/cancellation.h"
#include "base/vec3.h"
#include "space_certificate/certificate.h"
#include "space_vertices/body_volumes.h"
#include "space_vertices/qef.h"
#include "space_vertices/thinning.h"
#include "space_vertices/vertices.h"
#include "space_vertices/virtual_plane.h"

namespace partiemc {
namespace {

// The certificate and the cuts of the quads change the volumes of small bodies. So the volumes of
// bodies with a larger relative error than kVolumeTolerance are corrected again afterwards, at most
// kVolumeRounds times.
constexpr int kVolumeRounds = 4;
constexpr double kVolumeTolerance = .001;
constexpr space::VirtualPlaneConstants kConstants;

void KeepFixedVertices(SurfaceWorkspace::Buffers& b) {
  for (std::size_t v = 0; v < b.positions.size(); ++v) {
    if (b.is_fixed[v] != 0) b.positions[v] = b.anchors[v];
  }
}

/// Vertices of settled bodies stay at their anchors.
void FixSettledBodies(SurfaceWorkspace::Buffers& b) {
  b.certificate.is_settled.clear();
  if (b.drops.is_settled.empty()) return;
  const std::vector<std::uint32_t>& body_of = b.virtual_plane.volumes.body_of;
  b.certificate.is_settled.resize(body_of.size());
  for (std::size_t v = 0; v < body_of.size(); ++v) {
    if (b.drops.is_settled[body_of[v]] == 0) continue;
    b.certificate.is_settled[v] = b.is_fixed[v] = 1;
  }
}

/// A step of SearchVolumes with offsets of at most `limit` spacings. Positions are in world units.
/// Returns whether any body moved.
bool CorrectVolumes(const Scale& scale, double limit, SurfaceWorkspace::Buffers& b) {
  space::BodyVolumes& volumes = b.virtual_plane.volumes;
  space::MeasureTriangles(b.bins.bricks, scale.cell_size, b.bodies, b.positions, b.mesh.triangles,
                          volumes);
  const bool has_moved = space::SearchVolumes(
      b.bodies, {.limit = limit * scale.spacing * scale.cell_size, .tolerance = kVolumeTolerance},
      b.normals, volumes, b.positions);
  space::SaveOrReturnSetbacks(volumes.body_of, volumes.steps, b.certificate);
  if (has_moved) KeepFixedVertices(b);
  return has_moved;
}

}  // namespace

void PlaceByMarchingCubes(double cell_size, SurfaceWorkspace::Buffers& b) {
  const space::BrickDirectory& bricks = b.bins.bricks;
  space::PlaceOnCrossings(bricks, b.field, b.crossings, space::kEdgeMargin, b.positions);
  space::EmitMarchingCubes(b.crossings, b.mesh.triangles);
  b.thin.clear();
  for (Vec3& position : b.positions) position = cell_size * position;
  space::NormalsFromTriangles(space::NormalWeights::kArea, b.positions, b.mesh.triangles,
                              b.normals);
}

absl::Status PlaceMovedVertices(const SurfaceParameters& parameters, const Scale& scale,
                                SurfaceWorkspace::Buffers& b) {
  const SurfacePlacement placement = parameters.placement;
  const space::BrickDirectory& bricks = b.bins.bricks;
  space::PlaceOnCrossings(bricks, b.field, b.crossings, space::kAnchorMargin, b.anchors);
  space::MarkFixedVertices(b.crossings, b.is_fixed);
  FixSettledBodies(b);
  if (placement == SurfacePlacement::kQef) {
    space::PlaceOnCrossings(bricks, b.field, b.crossings, space::kEdgeMargin, b.positions);
    space::PlaceByQef(b.bins, scale, b.crossings, b.positions, b.normals);
    b.virtual_plane.volumes.sizes.clear();
  } else {
    space::PlaceOnPlanes({b.bins, b.field, b.crossings, b.bodies, scale}, kConstants, b.anchors,
                         b.virtual_plane, b.positions, b.normals);
  }
  KeepFixedVertices(b);
  for (Vec3& position : b.positions) position = scale.cell_size * position;
  for (Vec3& anchor : b.anchors) anchor = scale.cell_size * anchor;
  // Empty for qef and for equal sizes.
  const std::span<const float> sizes(b.virtual_plane.volumes.sizes);
  space::BeginSearch(b.bodies, b.positions, b.drops.is_settled, b.virtual_plane.volumes);
  for (int round = 0;; ++round) {
    ThrowIfCancelled();
    const auto certify = round == 0 ? space::Certify : space::CertifyAgain;
    if (!certify(bricks, b.crossings, scale.cell_size, b.anchors, b.positions, b.certificate)) {
      return absl::InternalError("a face is refused although its vertices are at their anchors");
    }
    space::FindThinEdges(bricks, b.crossings, scale.cell_size, b.certificate, b.positions,
                         parameters.thinning_distance * scale.spacing, b.thin, sizes);
    space::EmitQuads(bricks, b.crossings, b.certificate, b.thin, b.mesh.triangles);
    if (placement != SurfacePlacement::kVirtualPlane || round > kVolumeRounds) break;
    if (round == 0) {
      space::FindBodyOfNodes(bricks, b.crossings, b.virtual_plane.volumes.body_of, b.certificate);
    }
    if (!CorrectVolumes(scale, round < kVolumeRounds ? kConstants.volume_limit : 0, b)) break;
  }
  return absl::OkStatus();
}

}  // namespace partiemc
