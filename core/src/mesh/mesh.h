// Stage 8 of 9: rings and interior cells -> triangles (paper, sections 3.7-3.8).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "crossings/crossings.h"
#include "mesh/blocks.h"
#include "mesh/loop_groups.h"
#include "mesh/node_vertices.h"
#include "mesh/rectangles.h"
#include "mesh/staircase.h"
#include "normals/normals.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "rings/rings.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Scratch of BuildMesh.
struct MeshScratch {
  std::vector<BitRows> interior;  // By tile: interior cells that no ring touches.
  Staircases staircases;
  MergeScratch merge;
  std::vector<CellRectangle> rectangles;
  LoopGroups loops;
  NodeVertices nodes;
  Blocks blocks;
  std::vector<std::uint32_t> corner_numbers;  // By corner of the staircases: its point in the mesh.
  std::vector<std::uint32_t> triangles;       // Of the interior cells.
  std::vector<double> points;                 // Keeps the nodes while ring points are replaced.
};

/// Results of the earlier stages.
struct MeshInput {
  const TileDirectory& directory;
  const Crossings& crossings;
  const RingTopology& topology;
  const std::vector<CellPlane>& planes;
  const PlacedVertices& placed;
  const Rings& rings;
  const ReconstructionParameters& parameters;
  const Scale& scale;
  const AttributeSource* attributes = nullptr;  ///< Null unless the mesh has blocks.
};

/// Whether the mesh has blocks (blocks.h) if the frame has attributes.
inline bool HasBlocks(const ReconstructionParameters& parameters) {
  return parameters.fill == Fill::kGreedy && parameters.attribute_tolerance < 1;
}

/// Fills the rings with triangles by `parameters.fill`. Sets `triangles`, `triangles_grid` and
/// `folded_triangles` of the statistics. `none` makes no triangles; `polygon` triangulates the
/// whole inside of the rings and does not use interior cells.
///
/// The other fills triangulate the band between the rings and the staircase of the interior cells
/// without new points. The band is the same for `grid`, `greedy` without blocks, and `conforming`.
/// With blocks, the band also has the corners of blocks along the staircase, so the mesh has no
/// T-junctions. If vertices are particles (placement_traits.h), the middles of the segments are
/// triangulated and then moved to the vertices, which may fold triangles. Returns false if a
/// component cannot be triangulated. That is a bug: rings are simple, and the remaining interior
/// cells lie inside the rings. Cost: n log n in the points of rings and staircases, linear in
/// cells.
[[nodiscard]] bool BuildMesh(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
                             FrameStatistics& statistics);

}  // namespace partiemc
