#include "mesh/mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "base/parallel.h"
#include "base/predicates.h"
#include "frame/placement_traits.h"
#include "mesh/touched_cells.h"

namespace partiemc {
namespace {

// The state of BuildMesh. Points are numbered as follows: first the points of the rings (the
// middles of all segments if vertices move), then the lattice nodes that triangles use. With
// several threads, loops are triangulated before the nodes are numbered. The corners of the
// staircases then take the place of the nodes until PutNodesInPlace.
struct Work {
  const MeshInput& input;
  MeshScratch& scratch;
  Mesh& mesh;
  std::size_t ring_points = 0;  // Number of points before the lattice nodes.
  std::uint64_t interior_cells = 0;
  bool is_complete = true;  // Every group of loops has been triangulated.

  bool MovesVertices() const { return TraitsOf(input.parameters.placement).takes_particles; }
  bool HasBlocks() const { return input.attributes != nullptr; }
  bool HasBand() const {
    return input.parameters.fill != Fill::kNone && input.parameters.fill != Fill::kPolygon;
  }
};

void FindInterior(Work& w) {
  w.scratch.interior = w.input.crossings.interior;
  if (!TraitsOf(w.input.parameters.placement).refines) return;
  ExcludeTouchedCells(w.input.directory, w.input.rings.points, w.input.rings.offsets,
                      w.input.placed.roots, w.input.scale.cell_size, w.scratch.interior);
}

void CollectRingPoints(Work& w) {
  if (!w.MovesVertices()) {
    w.mesh.points = w.input.rings.points;
  } else {
    const double cell_size = w.input.scale.cell_size;
    w.mesh.points.clear();
    for (const CellPlane& plane : w.input.planes) {
      w.mesh.points.push_back((plane.entry.x + plane.exit.x) / 2 * cell_size);
      w.mesh.points.push_back((plane.entry.y + plane.exit.y) / 2 * cell_size);
    }
  }
  w.ring_points = w.mesh.PointCount();
}

// Calls visit(CellRectangle) for each rectangle of the fill; `grid` has one for each cell.
template <typename Visit>
void ForEachRectangle(const Work& w, Visit visit) {
  for (const CellRectangle& rectangle : w.scratch.rectangles) visit(rectangle);
  if (w.input.parameters.fill != Fill::kGrid) return;
  for (std::uint32_t tile = 0; tile < w.input.directory.size(); ++tile) {
    for (int j = 0; j < kTileSize; ++j) {
      for (std::uint32_t row = w.scratch.interior[tile][j]; row != 0; row &= row - 1) {
        visit(CellRectangle{{tile, std::countr_zero(row), j}, 1, 1});
      }
    }
  }
}

// Numbers the corners of the rectangles and makes two triangles of each rectangle. Every corner of
// a staircase is also a corner of a rectangle. Proof: the four cells around a staircase corner
// contain one or three interior cells, or two diagonal ones. A rectangle that touches a node
// without having a corner there covers two adjacent cells of the four, or all. Such rectangles
// cannot cover the interior cells around a staircase corner.
void FillRectangles(Work& w) {
  w.scratch.rectangles.clear();
  if (w.input.parameters.fill == Fill::kGreedy) {
    MergeCells(w.input.directory, w.scratch.interior, w.scratch.merge, w.scratch.rectangles);
  }
  w.interior_cells = CountCells(w.scratch.interior);
  NodeVertices& nodes = w.scratch.nodes;
  nodes.Clear(w.input.directory.size());
  ForEachRectangle(w, [&](const CellRectangle& rectangle) {
    for (const TilePlace& corner : CornersOf(w.input.directory, rectangle)) nodes.Add(corner);
  });
  nodes.Number(static_cast<std::uint32_t>(w.ring_points));
  w.scratch.triangles.resize(6 * (w.input.parameters.fill == Fill::kGrid
                                      ? w.interior_cells
                                      : w.scratch.rectangles.size()));
  std::uint32_t* next = w.scratch.triangles.data();
  ForEachRectangle(w, [&](const CellRectangle& rectangle) {
    std::array<std::uint32_t, 4> corners;
    std::ranges::transform(CornersOf(w.input.directory, rectangle), corners.begin(),
                           [&](const TilePlace& node) { return nodes.At(node); });
    for (const int corner : {0, 1, 2, 0, 2, 3}) *next++ = corners[corner];
  });
}

// The vertices of a block, counter-clockwise: its corners, and the middles of its edges that are
// corners of other blocks.
struct BlockOutline {
  std::array<std::uint32_t, 8> vertices;
  int count = 0;
  int first_middle = -1;
};

BlockOutline OutlineOf(const TileDirectory& directory, const NodeVertices& nodes,
                       const CellRectangle& block) {
  BlockOutline outline;
  const auto [tile, i, j] = block.corner;
  const int side = block.width, half = side / 2;
  const std::array<std::array<int, 2>, 8> steps = {{{0, 0},
                                                    {half, 0},
                                                    {side, 0},
                                                    {side, half},
                                                    {side, side},
                                                    {half, side},
                                                    {0, side},
                                                    {0, half}}};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const bool is_middle = k % 2 == 1;
    if (is_middle && half == 0) continue;
    const TilePlace node = Normalise(directory, tile, i + steps[k][0], j + steps[k][1]);
    if (is_middle && !nodes.Contains(node)) continue;
    if (is_middle && outline.first_middle < 0) outline.first_middle = outline.count;
    outline.vertices[outline.count++] = nodes.At(node);
  }
  return outline;
}

// Numbers the corners of the blocks and divides each block into triangles: a fan around the first
// middle of an edge, or two triangles. Two neighbours share all vertices of their common edge.
void FillBlocks(Work& w) {
  FindBlocks(w.input.directory, w.scratch.interior, w.input.scale.cell_size, *w.input.attributes,
             w.scratch.blocks);
  w.interior_cells = CountCells(w.scratch.interior);
  NodeVertices& nodes = w.scratch.nodes;
  nodes.Clear(w.input.directory.size());
  ForEachBlock(w.scratch.blocks, [&](const CellRectangle& block) {
    for (const TilePlace& corner : CornersOf(w.input.directory, block)) nodes.Add(corner);
  });
  nodes.Number(static_cast<std::uint32_t>(w.ring_points));
  std::size_t triangle_count = 0;
  ForEachBlock(w.scratch.blocks, [&](const CellRectangle& block) {
    triangle_count += OutlineOf(w.input.directory, nodes, block).count - 2;
  });
  w.scratch.triangles.resize(3 * triangle_count);
  std::uint32_t* next = w.scratch.triangles.data();
  ForEachBlock(w.scratch.blocks, [&](const CellRectangle& block) {
    const BlockOutline outline = OutlineOf(w.input.directory, nodes, block);
    const int first = std::max(outline.first_middle, 0);
    for (int k = 1; k + 1 < outline.count; ++k) {
      for (const int corner : {0, k, k + 1}) {
        *next++ = outline.vertices[(first + corner) % outline.count];
      }
    }
  });
}

// Finds the node number of each staircase corner.
void NumberCorners(Work& w) {
  const std::vector<TilePlace>& corners = w.scratch.staircases.corners;
  NodeVertices& nodes = w.scratch.nodes;
  if (w.input.parameters.fill == Fill::kConforming) {
    for (const TilePlace& corner : corners) nodes.Add(corner);
    nodes.Number(static_cast<std::uint32_t>(w.ring_points));
  }
  w.scratch.corner_numbers.resize(corners.size());
  if (!w.HasBand()) return;
  std::ranges::transform(corners, w.scratch.corner_numbers.begin(),
                         [&](const TilePlace& node) { return nodes.At(node); });
}

// Appends the staircase corners to the points. A node that loops pass twice is appended twice.
void AppendCorners(Work& w) {
  for (const TilePlace& corner : w.scratch.staircases.corners) {
    const Point point = NodePoint(w.input.directory, corner, w.input.scale.cell_size);
    w.mesh.points.insert(w.mesh.points.end(), {point.x, point.y});
  }
  w.scratch.corner_numbers.resize(w.scratch.staircases.corners.size());
  std::iota(w.scratch.corner_numbers.begin(), w.scratch.corner_numbers.end(),
            static_cast<std::uint32_t>(w.ring_points));
}

void AppendNodes(Work& w) {
  w.scratch.nodes.AppendPoints(w.input.directory, w.input.scale.cell_size, w.mesh.points);
}

// Replaces the staircase corners, in points and triangles, by the nodes.
void PutNodesInPlace(Work& w) {
  NumberCorners(w);
  w.mesh.points.resize(2 * w.ring_points);
  const auto renumber = [&] {
    if (w.scratch.corner_numbers.empty()) return;
    const auto first = static_cast<std::uint32_t>(w.ring_points);
    for (std::uint32_t& point : w.mesh.triangles) {
      // Branch-free, since the branch would be unpredictable.
      const bool is_corner = point >= first;
      const std::uint32_t number = w.scratch.corner_numbers[is_corner ? point - first : 0];
      point = is_corner ? number : point;
    }
  };
  ParallelInvoke(renumber, [&] { AppendNodes(w); });
}

// Adds the rings as loops. The group of a loop is the outer ring of its component.
void AddRingLoops(Work& w) {
  const std::vector<std::uint32_t>& offsets =
      w.MovesVertices() ? w.input.topology.offsets : w.input.rings.offsets;
  const std::vector<std::uint32_t>& groups = w.input.placed.group_of_ring;
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    w.scratch.loops.AddPoints(offsets[ring], offsets[ring + 1]);
    if (!groups.empty()) {
      w.scratch.loops.EndLoop(groups[ring]);
      continue;
    }
    const std::uint32_t outer = w.input.topology.outer_of[ring];
    w.scratch.loops.EndLoop(outer == kNoRing ? ring : outer);
  }
}

// Adds the staircases as loops. The corners of a loop lie in one component, since the interior
// contains no cell that a ring touches.
void AddStaircaseLoops(Work& w, bool reversed) {
  const Staircases& staircases = w.scratch.staircases;
  const RingTopology& rings = w.input.topology;
  const std::span<const std::uint32_t> numbers = w.scratch.corner_numbers;
  for (std::size_t loop = 0; loop + 1 < staircases.offsets.size(); ++loop) {
    const std::uint32_t first = staircases.offsets[loop];
    w.scratch.loops.AddPoints(numbers.subspan(first, staircases.offsets[loop + 1] - first));
    const std::uint32_t component =
        rings.components.At(w.input.crossings, staircases.corners[first]);
    w.scratch.loops.EndLoop(rings.outer_ring[component], reversed);
  }
}

void TriangulateLoops(Work& w, TriangleClass triangle_class) {
  w.is_complete &= w.scratch.loops.Triangulate(w.mesh.points, w.mesh.triangles);
  w.mesh.classes.resize(w.mesh.triangles.size() / 3, triangle_class);
}

// Triangulates the regions bounded by rings and staircases. `polygon` uses no staircases: it
// triangulates the whole inside of the rings. All other fills triangulate the band between rings
// and staircases. `conforming` then also triangulates the interior, bounded by staircases only.
void TriangulateByLoops(Work& w) {
  w.scratch.loops.Clear();
  AddRingLoops(w);
  if (w.HasBand()) AddStaircaseLoops(w, true);
  TriangulateLoops(w, TriangleClass::kBoundary);
  if (w.input.parameters.fill != Fill::kConforming) return;
  AddStaircaseLoops(w, false);
  TriangulateLoops(w, TriangleClass::kInterior);
}

// Traces the staircases and triangulates everything. With several threads, rectangles are made in
// parallel with the band, because a single long ring uses only one thread. A single thread numbers
// the nodes first, which avoids renumbering. Both ways produce the same triangles.
void TriangulateAll(Work& w) {
  const auto trace = [&](const NodeVertices* nodes) {
    TraceStaircases(w.input.directory, w.scratch.interior, nodes, w.scratch.staircases);
  };
  if (w.HasBlocks()) {
    FillBlocks(w);
    trace(&w.scratch.nodes);
    NumberCorners(w);
    AppendNodes(w);
    TriangulateByLoops(w);
  } else if (ThreadCount() == 1) {
    trace(nullptr);
    FillRectangles(w);
    NumberCorners(w);
    AppendNodes(w);
    TriangulateByLoops(w);
  } else {
    const auto sweep = [&] {
      trace(nullptr);
      AppendCorners(w);
      TriangulateByLoops(w);
    };
    ParallelInvoke(sweep, [&] { FillRectangles(w); });
    PutNodesInPlace(w);
  }
  w.mesh.triangles.insert(w.mesh.triangles.end(), w.scratch.triangles.begin(),
                          w.scratch.triangles.end());
  w.mesh.classes.resize(w.mesh.triangles.size() / 3, TriangleClass::kInterior);
}

// Replaces the middles of the segments by the vertices of the rings. Drops the triangles of
// collapsed rings and the triangles with two equal vertices.
void MoveVertices(Work& w) {
  const std::size_t target_ring_points = w.input.rings.PointCount();
  const auto moved = [&](std::uint32_t point) {
    return point < w.ring_points
               ? w.input.placed.point_of_segment[point]
               : static_cast<std::uint32_t>(point - w.ring_points + target_ring_points);
  };
  std::size_t kept = 0;
  for (std::size_t k = 0; k < w.mesh.classes.size(); ++k) {
    const std::uint32_t a = moved(w.mesh.triangles[3 * k]);
    const std::uint32_t b = moved(w.mesh.triangles[3 * k + 1]);
    const std::uint32_t c = moved(w.mesh.triangles[3 * k + 2]);
    if (a == kNoPoint || b == kNoPoint || c == kNoPoint) continue;
    if (a == b || b == c || c == a) continue;
    w.mesh.triangles[3 * kept] = a;
    w.mesh.triangles[3 * kept + 1] = b;
    w.mesh.triangles[3 * kept + 2] = c;
    w.mesh.classes[kept++] = w.mesh.classes[k];
  }
  w.mesh.triangles.resize(3 * kept);
  w.mesh.classes.resize(kept);
  w.scratch.points.assign(w.mesh.points.begin() + 2 * w.ring_points, w.mesh.points.end());
  w.mesh.points = w.input.rings.points;
  w.mesh.points.insert(w.mesh.points.end(), w.scratch.points.begin(), w.scratch.points.end());
}

// The number of triangles of the band by Euler's formula, N - 2 chi. N counts the points on rings
// and staircases, chi = chi(inside of the rings) - chi(interior cells).
std::uint64_t ExpectedBandTriangles(const Work& w) {
  const Staircases& staircases = w.scratch.staircases;
  std::int64_t rings = 0;
  for (const std::uint32_t outer : w.input.rings.outer_of) rings += outer == kNoRing ? 1 : -1;
  const std::size_t points = w.input.rings.PointCount() + staircases.corners.size();
  return static_cast<std::uint64_t>(
      static_cast<std::int64_t>(points) -
      2 * (rings - EulerCharacteristic(w.input.directory, staircases)));
}

std::uint64_t CountFolded(const Work& w) {
  const auto point = [&](std::uint32_t index) { return PointAt(w.mesh.points, index); };
  std::uint64_t count = 0;
  for (std::size_t k = 0; k < w.mesh.triangles.size(); k += 3) {
    count += Orientation(point(w.mesh.triangles[k]), point(w.mesh.triangles[k + 1]),
                         point(w.mesh.triangles[k + 2])) <= 0;
  }
  return count;
}

}  // namespace

bool BuildMesh(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
               FrameStatistics& statistics) {
  Work w{input, scratch, mesh};
  w.mesh.Clear();
  FindInterior(w);
  if (w.input.parameters.fill == Fill::kNone) {
    TraceStaircases(w.input.directory, w.scratch.interior, nullptr, w.scratch.staircases);
    w.interior_cells = CountCells(w.scratch.interior);
  } else {
    CollectRingPoints(w);
    TriangulateAll(w);
    if (!w.is_complete) return false;
    if (w.MovesVertices()) MoveVertices(w);
  }
  // Each requested node on a straight part of a staircase adds one triangle that `grid` does not
  // have.
  const auto band_triangles =
      w.HasBand() ? static_cast<std::uint64_t>(std::count(
                        w.mesh.classes.begin(), w.mesh.classes.end(), TriangleClass::kBoundary)) -
                        w.scratch.staircases.straight_nodes
                  : ExpectedBandTriangles(w);
  statistics.triangles = w.mesh.TriangleCount();
  statistics.triangles_grid = 2 * w.interior_cells + band_triangles;
  statistics.folded_triangles = w.MovesVertices() ? CountFolded(w) : 0;
  return true;
}

}  // namespace partiemc
