// The geometry that the formats of meshes write: a surface, or the mesh and the rings of an
// outline.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/output/frame_record.h"
#include "partiemc/result.h"
#include "partiemc/surface.h"

namespace partiemc::client {

/// The name of FileMesh::Cuts in files.
inline constexpr const char* kCut = "cut";

/// Whether the mesh starts with the points of the rings, bit for bit. Guarantee M3 of result.h
/// states this for all placements except `farthest-particle`.
bool MeshSharesRingPoints(const Result& result);

/// The vertices of an outline are the points of its mesh, then the points of its rings. If the mesh
/// starts with the points of the rings, both share these vertices. The record must outlive this
/// object.
class FileMesh {
 public:
  explicit FileMesh(const FrameRecord& frame);

  /// Null for an outline.
  const Surface* surface() const { return surface_; }

  /// x0, y0, z0, x1, ...; z is 0 for an outline.
  std::span<const double> points() const { return surface_ ? surface_->points : lifted_; }
  std::size_t PointCount() const { return points().size() / 3; }
  /// Three per vertex; empty for an outline.
  std::span<const float> normals() const;
  /// Empty unless each vertex has a value.
  std::span<const AttributeValues> attributes() const;
  /// Three vertex indices each.
  std::span<const std::uint32_t> triangles() const;
  std::size_t TriangleCount() const { return triangles().size() / 3; }
  /// Whether each triangle lies on a wall or on a face of a periodic box. Empty if none does.
  std::vector<bool> Cuts() const;

  /// Empty for a surface.
  const Rings& rings() const;
  /// Index of the vertex that is the first point of the rings.
  std::uint32_t first_of_rings() const { return first_of_rings_; }
  /// Two vertex indices for each segment of the rings.
  std::vector<std::uint32_t> Sides() const;

 private:
  const Result& outline_;
  const Surface* surface_;
  std::vector<double> lifted_;  // The points of an outline with z = 0.
  std::uint32_t first_of_rings_ = 0;
  bool have_attributes_ = false;
};

/// Body of each shell, numbered from 0 in the order of the outer shells. A cavity has the body that
/// surrounds it.
std::vector<std::uint32_t> BodyOfShells(const Surface& surface);

}  // namespace partiemc::client
