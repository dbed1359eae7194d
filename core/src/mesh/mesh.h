// Stage 8 of 9: rings and interior cells -> triangles (paper, sections 3.7-3.8).
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "crossings/crossings.h"
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

/// Warm buffers of BuildMesh.
struct MeshScratch {
  std::vector<BitRows> interior;  // The interior cells that no ring touches, by tile.
  Staircases staircases;
  MergeScratch merge;
  std::vector<CellRectangle> rectangles;
  LoopGroups loops;
  NodeVertices nodes;
  std::vector<std::uint32_t> corner_numbers;  // By corner of the staircases: of its node.
  std::vector<std::uint32_t> triangles;       // Of the rectangles.
  std::vector<double> points;                 // Of a connectivity that is not yet the mesh's.
};

struct MeshInput {
  const TileDirectory& directory;
  const Crossings& crossings;
  const RingTopology& topology;
  const std::vector<CellPlane>& planes;
  const PlacedVertices& placed;
  const Rings& rings;
  const ReconstructionParameters& parameters;
  const Scale& scale;
};

/// Fills the rings with triangles as parameters.fill says and sets `triangles`, `triangles_grid`
/// and `folded_triangles` of the statistics.
///
/// The band between the rings and the staircase of the interior cells is triangulated without new
/// points, and is the same for grid, greedy and conforming. `farthest-particle` takes its
/// connectivity from the middles of the segments and only then moves the vertices, so that a
/// triangle folds where the vertices do.
/// Components that cannot be triangulated, which is a bug, are named in `tangled` by their outer
/// rings of RingTopology; the mesh is then worth nothing.
/// Cost: n log n in the points of rings and staircases, linear in cells.
void BuildMesh(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
               FrameStatistics& statistics, std::vector<std::uint32_t>& tangled);

}  // namespace partiemc
