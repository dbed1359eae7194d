#include "client/output/formats/file_mesh.h"

#include <cstring>

#include "partiemc/surface_state.h"

namespace partiemc::client {
namespace {

void AppendLifted(std::span<const double> plane_points, std::vector<double>& points) {
  for (std::size_t k = 0; k < plane_points.size(); k += 2) {
    points.insert(points.end(), {plane_points[k], plane_points[k + 1], 0});
  }
}

}  // namespace

bool MeshSharesRingPoints(const Result& result) {
  const std::vector<double>& rings = result.rings.points;
  return rings.empty() ||
         (result.mesh.points.size() >= rings.size() &&
          std::memcmp(result.mesh.points.data(), rings.data(), rings.size() * sizeof(double)) == 0);
}

FileMesh::FileMesh(const FrameRecord& frame) : outline_(frame.result), surface_(frame.surface) {
  if (surface_) return;
  const bool shared = MeshSharesRingPoints(outline_);
  have_attributes_ = shared || outline_.mesh.points.empty();
  AppendLifted(outline_.mesh.points, lifted_);
  if (shared) return;
  first_of_rings_ = static_cast<std::uint32_t>(outline_.mesh.PointCount());
  AppendLifted(outline_.rings.points, lifted_);
}

std::span<const float> FileMesh::normals() const {
  if (surface_) return surface_->normals;
  return {};
}

std::span<const AttributeValues> FileMesh::attributes() const {
  if (surface_) return surface_->attributes;
  if (have_attributes_) return outline_.attributes;
  return {};
}

std::span<const std::uint32_t> FileMesh::triangles() const {
  return surface_ ? surface_->triangles : outline_.mesh.triangles;
}

std::vector<bool> FileMesh::Cuts() const {
  if (surface_ == nullptr || surface_->cuts.empty()) return {};
  std::vector<bool> cuts(TriangleCount());
  for (const std::uint32_t triangle : surface_->cuts) cuts[triangle] = true;
  return cuts;
}

const Rings& FileMesh::rings() const {
  static const Rings kNone;
  return surface_ ? kNone : outline_.rings;
}

std::vector<std::uint32_t> FileMesh::Sides() const {
  std::vector<std::uint32_t> sides;
  for (std::size_t ring = 0; ring < rings().RingCount(); ++ring) {
    const std::uint32_t begin = rings().offsets[ring], end = rings().offsets[ring + 1];
    for (std::uint32_t k = begin; k < end; ++k) {
      sides.push_back(first_of_rings_ + k);
      sides.push_back(first_of_rings_ + (k + 1 == end ? begin : k + 1));
    }
  }
  return sides;
}

std::vector<std::uint32_t> BodyOfShells(const Surface& surface) {
  std::vector<std::uint32_t> bodies(surface.ShellCount());
  std::uint32_t count = 0;
  for (std::size_t shell = 0; shell < bodies.size(); ++shell) {
    if (surface.outer_of[shell] == kNoShell) bodies[shell] = count++;
  }
  for (std::size_t shell = 0; shell < bodies.size(); ++shell) {
    if (surface.outer_of[shell] != kNoShell) bodies[shell] = bodies[surface.outer_of[shell]];
  }
  return bodies;
}

}  // namespace partiemc::client
