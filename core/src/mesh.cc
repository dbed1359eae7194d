#include "mesh.h"

#include <algorithm>
#include <array>
#include <bit>

#include "bits.h"
#include "parallel.h"
#include "predicates.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kUnset = 0xffffffff;

// Builds one mesh. Points of the connectivity: the points of the rings (for `farthest-particle`:
// the middles of all segments), then lattice nodes as they are needed.
class MeshBuilder {
 public:
  MeshBuilder(const MeshInput& input, MeshScratch& scratch, Mesh& mesh)
      : input_(input), scratch_(scratch), mesh_(mesh) {}

  absl::Status Build(FrameStatistics& statistics);

 private:
  bool MovesVertices() const { return input_.parameters.placement == Placement::kFarthestParticle; }
  void CollectRingPoints();
  std::uint32_t Vertex(const TilePlace& node);
  std::uint32_t Vertex(std::int64_t x, std::int64_t y);
  void AddRingLoops();
  void AddStaircaseLoops(bool reversed);
  std::uint32_t OuterRingAt(const TilePlace& inside_node) const;
  absl::Status TriangulateLoops(TriangleClass triangle_class);
  void AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, TriangleClass triangle_class);
  void AddRectangle(const CellRectangle& rectangle);
  absl::Status FillBand();
  void FillGrid();
  void FillGreedy();
  absl::Status FillInterior();
  void MoveVertices();
  std::uint64_t CountInteriorCells() const;
  std::uint64_t ExpectedBandTriangles() const;
  std::uint64_t CountFolded() const;
  void Reset();

  const MeshInput& input_;
  MeshScratch& scratch_;
  Mesh& mesh_;
  std::size_t ring_points_ = 0;  // Points of the connectivity that belong to rings.
};

void MeshBuilder::CollectRingPoints() {
  if (!MovesVertices()) {
    mesh_.points = input_.rings.points;
  } else {
    const double cell_size = input_.scale.cell_size;
    mesh_.points.clear();
    for (const CellPlane& plane : input_.planes) {
      mesh_.points.push_back((plane.entry.x + plane.exit.x) / 2 * cell_size);
      mesh_.points.push_back((plane.entry.y + plane.exit.y) / 2 * cell_size);
    }
  }
  ring_points_ = mesh_.PointCount();
}

std::uint32_t MeshBuilder::Vertex(const TilePlace& node) {
  const std::uint32_t key = node.tile * kTileNodes + node.j * kTileSize + node.i;
  std::uint32_t& vertex = scratch_.vertex_of_node[key];
  if (vertex != kUnset) return vertex;
  vertex = static_cast<std::uint32_t>(mesh_.PointCount());
  scratch_.touched_nodes.push_back(key);
  const TileCoordinate& tile = input_.directory[node.tile];
  const auto world = [this](std::int32_t origin, int offset) {
    return static_cast<double>((std::int64_t{origin} << kTileShift) + offset) *
           input_.scale.cell_size;
  };
  mesh_.points.push_back(world(tile.x, node.i));
  mesh_.points.push_back(world(tile.y, node.j));
  return vertex;
}

std::uint32_t MeshBuilder::Vertex(std::int64_t x, std::int64_t y) {
  const std::uint32_t tile = input_.directory.Find(
      {static_cast<std::int32_t>(y >> kTileShift), static_cast<std::int32_t>(x >> kTileShift)});
  return Vertex(TilePlace{tile, static_cast<int>(x & (kTileSize - 1)),
                          static_cast<int>(y & (kTileSize - 1))});
}

// Loops are grouped by components, each named by its outer ring.
void MeshBuilder::AddRingLoops() {
  const std::vector<std::uint32_t>& offsets =
      MovesVertices() ? input_.topology.offsets : input_.rings.offsets;
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    for (std::uint32_t k = offsets[ring]; k < offsets[ring + 1]; ++k) scratch_.loops.AddPoint(k);
    const std::uint32_t outer = input_.topology.outer_of[ring];
    scratch_.loops.EndLoop(outer == kNoRing ? ring : outer);
  }
}

std::uint32_t MeshBuilder::OuterRingAt(const TilePlace& inside_node) const {
  const RingScratch& scratch = input_.ring_scratch;
  return scratch.outer_ring[scratch.components.At(input_.crossings, inside_node)];
}

void MeshBuilder::AddStaircaseLoops(bool reversed) {
  const Staircases& staircases = scratch_.staircases;
  for (std::size_t loop = 0; loop + 1 < staircases.offsets.size(); ++loop) {
    for (std::uint32_t k = staircases.offsets[loop]; k < staircases.offsets[loop + 1]; ++k) {
      scratch_.loops.AddPoint(Vertex(staircases.corners[k]));
    }
    // The corners of interior cells are inside, in one component: cells stay on their side of every
    // ring, or were excluded.
    scratch_.loops.EndLoop(OuterRingAt(staircases.corners[staircases.offsets[loop]]), reversed);
  }
}

absl::Status MeshBuilder::TriangulateLoops(TriangleClass triangle_class) {
  if (!scratch_.loops.Triangulate(mesh_.points, mesh_.triangles)) {
    return absl::InternalError("mesh: the rings of this frame cannot be triangulated");
  }
  mesh_.classes.resize(mesh_.triangles.size() / 3, triangle_class);
  return absl::OkStatus();
}

void MeshBuilder::AddTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                              TriangleClass triangle_class) {
  mesh_.triangles.insert(mesh_.triangles.end(), {a, b, c});
  mesh_.classes.push_back(triangle_class);
}

void MeshBuilder::AddRectangle(const CellRectangle& rectangle) {
  const std::uint32_t a = Vertex(rectangle.x0, rectangle.y0);
  const std::uint32_t b = Vertex(rectangle.x1, rectangle.y0);
  const std::uint32_t c = Vertex(rectangle.x1, rectangle.y1);
  const std::uint32_t d = Vertex(rectangle.x0, rectangle.y1);
  AddTriangle(a, b, c, TriangleClass::kInterior);
  AddTriangle(a, c, d, TriangleClass::kInterior);
}

void MeshBuilder::FillGrid() {
  for (std::uint32_t tile = 0; tile < input_.directory.size(); ++tile) {
    const TileCoordinate& origin = input_.directory[tile];
    for (int j = 0; j < kTileSize; ++j) {
      for (std::uint32_t row = input_.crossings.tiles[tile].interior[j]; row != 0; row &= row - 1) {
        const std::int64_t x = (std::int64_t{origin.x} << kTileShift) + std::countr_zero(row);
        const std::int64_t y = (std::int64_t{origin.y} << kTileShift) + j;
        AddRectangle({x, y, x + 1, y + 1});
      }
    }
  }
}

void MeshBuilder::FillGreedy() {
  for (const CellRectangle& rectangle : scratch_.rectangles) AddRectangle(rectangle);
}

absl::Status MeshBuilder::FillInterior() {
  switch (input_.parameters.fill) {
    case Fill::kGrid:
      FillGrid();
      break;
    case Fill::kGreedy:
      FillGreedy();
      break;
    case Fill::kConforming:
      // The corners of the staircases are the only points that the band has there.
      AddStaircaseLoops(false);
      return TriangulateLoops(TriangleClass::kInterior);
    case Fill::kNone:
    case Fill::kPolygon:
      break;
  }
  return absl::OkStatus();
}

// Triangulates the loops of the band, and meanwhile finds the rectangles of the interior, which do
// not depend on it.
absl::Status MeshBuilder::FillBand() {
  absl::Status status;
  ParallelInvoke([&] { status = TriangulateLoops(TriangleClass::kBoundary); },
                 [&] {
                   if (input_.parameters.fill != Fill::kGreedy) return;
                   scratch_.rectangles.clear();
                   MergeCells(input_.directory, input_.crossings.tiles, scratch_.merge,
                              scratch_.rectangles);
                 });
  return status;
}

// Replaces the middles of the segments by the vertices of the rings. A triangle of which two
// vertices became one, or whose ring collapsed, goes.
void MeshBuilder::MoveVertices() {
  const std::size_t target_ring_points = input_.rings.PointCount();
  const auto moved = [&](std::uint32_t point) {
    return point < ring_points_
               ? input_.placed.point_of_segment[point]
               : static_cast<std::uint32_t>(point - ring_points_ + target_ring_points);
  };
  std::size_t kept = 0;
  for (std::size_t k = 0; k < mesh_.classes.size(); ++k) {
    const std::uint32_t a = moved(mesh_.triangles[3 * k]);
    const std::uint32_t b = moved(mesh_.triangles[3 * k + 1]);
    const std::uint32_t c = moved(mesh_.triangles[3 * k + 2]);
    if (a == kNoPoint || b == kNoPoint || c == kNoPoint) continue;
    if (a == b || b == c || c == a) continue;
    mesh_.triangles[3 * kept] = a;
    mesh_.triangles[3 * kept + 1] = b;
    mesh_.triangles[3 * kept + 2] = c;
    mesh_.classes[kept++] = mesh_.classes[k];
  }
  mesh_.triangles.resize(3 * kept);
  mesh_.classes.resize(kept);
  scratch_.points.assign(mesh_.points.begin() + 2 * ring_points_, mesh_.points.end());
  mesh_.points = input_.rings.points;
  mesh_.points.insert(mesh_.points.end(), scratch_.points.begin(), scratch_.points.end());
}

std::uint64_t MeshBuilder::CountInteriorCells() const {
  std::uint64_t count = 0;
  for (const TileBits& bits : input_.crossings.tiles) {
    for (const std::uint32_t row : bits.interior) count += CountBits(row);
  }
  return count;
}

// Triangles of the band by Euler's formula: n - 2 chi, where chi of the band is that of the rings'
// inside less that of the interior cells, whose pinches join them.
std::uint64_t MeshBuilder::ExpectedBandTriangles() const {
  const Staircases& staircases = scratch_.staircases;
  std::int64_t rings = 0;
  for (const std::uint32_t outer : input_.topology.outer_of) rings += outer == kNoRing ? 1 : -1;
  std::int64_t cells = -static_cast<std::int64_t>(staircases.pinches);
  for (std::size_t loop = 0; loop + 1 < staircases.offsets.size(); ++loop) {
    // Twice the signed area, exact in integers: corners differ by whole cells.
    std::int64_t twice_area = 0;
    const std::uint32_t first = staircases.offsets[loop];
    const std::uint32_t last = staircases.offsets[loop + 1];
    const auto at = [&](std::uint32_t k) {
      const TilePlace& node = staircases.corners[k];
      const TileCoordinate& tile = input_.directory[node.tile];
      return std::pair((std::int64_t{tile.x} << kTileShift) + node.i,
                       (std::int64_t{tile.y} << kTileShift) + node.j);
    };
    const auto origin = at(first);
    for (std::uint32_t k = first; k < last; ++k) {
      const auto a = at(k);
      const auto b = at(k + 1 < last ? k + 1 : first);
      // Of an axis-aligned loop: the integral of x dy.
      twice_area += 2 * (a.first - origin.first) * (b.second - a.second);
    }
    cells += twice_area > 0 ? 1 : -1;
  }
  const std::size_t points = input_.rings.PointCount() + staircases.corners.size();
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(points) - 2 * (rings - cells));
}

std::uint64_t MeshBuilder::CountFolded() const {
  const auto point = [this](std::uint32_t index) {
    return Point{mesh_.points[2 * index], mesh_.points[2 * index + 1]};
  };
  std::uint64_t count = 0;
  for (std::size_t k = 0; k < mesh_.triangles.size(); k += 3) {
    count += Orientation(point(mesh_.triangles[k]), point(mesh_.triangles[k + 1]),
                         point(mesh_.triangles[k + 2])) <= 0;
  }
  return count;
}

void MeshBuilder::Reset() {
  mesh_.Clear();
  scratch_.loops.Clear();
  for (const std::uint32_t key : scratch_.touched_nodes) scratch_.vertex_of_node[key] = kUnset;
  scratch_.touched_nodes.clear();
  const std::size_t nodes = input_.directory.size() * kTileNodes;
  if (scratch_.vertex_of_node.size() < nodes) scratch_.vertex_of_node.resize(nodes, kUnset);
}

absl::Status MeshBuilder::Build(FrameStatistics& statistics) {
  Reset();
  if (input_.parameters.placement == Placement::kVirtualPlane) {
    ExcludeTouchedCells(input_.directory, input_.rings.points, input_.rings.offsets,
                        input_.placed.roots, input_.scale.cell_size, input_.crossings.tiles);
  }
  TraceStaircases(input_.directory, input_.crossings.tiles, scratch_.staircases);
  std::uint64_t band_triangles = ExpectedBandTriangles();
  const Fill fill = input_.parameters.fill;
  if (fill != Fill::kNone) {
    CollectRingPoints();
    AddRingLoops();
    if (fill != Fill::kPolygon) AddStaircaseLoops(true);
    if (absl::Status status = FillBand(); !status.ok()) return status;
    if (absl::Status status = FillInterior(); !status.ok()) return status;
    if (MovesVertices()) MoveVertices();
    if (fill != Fill::kPolygon) {
      band_triangles = static_cast<std::uint64_t>(
          std::count(mesh_.classes.begin(), mesh_.classes.end(), TriangleClass::kBoundary));
    }
  }
  statistics.triangles = mesh_.TriangleCount();
  statistics.triangles_grid = 2 * CountInteriorCells() + band_triangles;
  statistics.folded_triangles = MovesVertices() ? CountFolded() : 0;
  return absl::OkStatus();
}

}  // namespace

absl::Status BuildMesh(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
                       FrameStatistics& statistics) {
  return MeshBuilder(input, scratch, mesh).Build(statistics);
}

}  // namespace partiemc
