#include "mesh.h"

#include <algorithm>
#include <array>
#include <bit>

#include "bits.h"
#include "parallel.h"
#include "predicates.h"
#include "touched_cells.h"

namespace partiemc {
namespace {

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
  std::array<TilePlace, 4> CornersOf(const CellRectangle& rectangle) const;
  template <typename Visit>
  void ForEachRectangle(Visit visit) const;
  void FindShapes();
  void AddNodes();
  void AddRingLoops();
  void AddStaircaseLoops(bool reversed);
  std::uint32_t OuterRingAt(const TilePlace& inside_node) const;
  absl::Status TriangulateLoops(TriangleClass triangle_class);
  void FillRectangles();
  absl::Status FillInterior();
  void MoveVertices();
  std::uint64_t CountInteriorCells() const;
  std::uint64_t ExpectedBandTriangles() const;
  std::uint64_t CountFolded() const;

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

// Loops are grouped by components, each named by its outer ring.
void MeshBuilder::AddRingLoops() {
  const std::vector<std::uint32_t>& offsets =
      MovesVertices() ? input_.topology.offsets : input_.rings.offsets;
  for (std::uint32_t ring = 0; ring + 1 < offsets.size(); ++ring) {
    scratch_.loops.AddPoints(offsets[ring], offsets[ring + 1]);
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
      scratch_.loops.AddPoint(scratch_.nodes.At(staircases.corners[k]));
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

// The corners of a rectangle, counter-clockwise from the lower left one. They are inside, so that
// there are tiles all along its sides.
std::array<TilePlace, 4> MeshBuilder::CornersOf(const CellRectangle& rectangle) const {
  const auto moved = [this](TilePlace place, int right, int up) {
    for (place.i += right; place.i >= kTileSize; place.i -= kTileSize) {
      place.tile = input_.directory.neighbours(place.tile)[5];
    }
    for (place.j += up; place.j >= kTileSize; place.j -= kTileSize) {
      place.tile = input_.directory.neighbours(place.tile)[7];
    }
    return place;
  };
  const TilePlace& corner = rectangle.corner;
  const TilePlace right = moved(corner, rectangle.width, 0);
  return {corner, right, moved(right, 0, rectangle.height), moved(corner, 0, rectangle.height)};
}

// Calls visit(CellRectangle) for each rectangle of the fill; `grid` has one for every cell.
template <typename Visit>
void MeshBuilder::ForEachRectangle(Visit visit) const {
  for (const CellRectangle& rectangle : scratch_.rectangles) visit(rectangle);
  if (input_.parameters.fill != Fill::kGrid) return;
  for (std::uint32_t tile = 0; tile < input_.directory.size(); ++tile) {
    for (int j = 0; j < kTileSize; ++j) {
      for (std::uint32_t row = scratch_.interior[tile][j]; row != 0; row &= row - 1) {
        visit(CellRectangle{{tile, std::countr_zero(row), j}, 1, 1});
      }
    }
  }
}

// Finds the shapes of the interior.
void MeshBuilder::FindShapes() {
  const std::span<const BitRows> interior = scratch_.interior;
  scratch_.rectangles.clear();
  ParallelInvoke([&] { TraceStaircases(input_.directory, interior, scratch_.staircases); },
                 [&] {
                   if (input_.parameters.fill != Fill::kGreedy) return;
                   MergeCells(input_.directory, interior, scratch_.merge, scratch_.rectangles);
                 });
}

// Adds the nodes that the triangles will have to the points.
void MeshBuilder::AddNodes() {
  NodeVertices& nodes = scratch_.nodes;
  nodes.Clear(input_.directory.size());
  for (const TilePlace& corner : scratch_.staircases.corners) nodes.Add(corner);
  ForEachRectangle([&](const CellRectangle& rectangle) {
    for (const TilePlace& corner : CornersOf(rectangle)) nodes.Add(corner);
  });
  nodes.Number(input_.directory, input_.scale.cell_size, mesh_.points);
}

// Two triangles for each rectangle.
void MeshBuilder::FillRectangles() {
  const std::size_t count =
      input_.parameters.fill == Fill::kGrid ? CountInteriorCells() : scratch_.rectangles.size();
  const std::size_t first = mesh_.triangles.size();
  mesh_.triangles.resize(first + 6 * count);
  mesh_.classes.resize(mesh_.triangles.size() / 3, TriangleClass::kInterior);
  std::uint32_t* next = mesh_.triangles.data() + first;
  ForEachRectangle([&](const CellRectangle& rectangle) {
    std::array<std::uint32_t, 4> corners;
    std::ranges::transform(CornersOf(rectangle), corners.begin(),
                           [this](const TilePlace& node) { return scratch_.nodes.At(node); });
    for (const int corner : {0, 1, 2, 0, 2, 3}) *next++ = corners[corner];
  });
}

absl::Status MeshBuilder::FillInterior() {
  if (input_.parameters.fill == Fill::kConforming) {
    // The corners of the staircases are the only points that the band has there.
    AddStaircaseLoops(false);
    return TriangulateLoops(TriangleClass::kInterior);
  }
  FillRectangles();
  return absl::OkStatus();
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
  for (const BitRows& rows : scratch_.interior) {
    for (const std::uint32_t row : rows) count += CountBits(row);
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

absl::Status MeshBuilder::Build(FrameStatistics& statistics) {
  mesh_.Clear();
  scratch_.interior = input_.crossings.interior;
  if (input_.parameters.placement == Placement::kVirtualPlane) {
    ExcludeTouchedCells(input_.directory, input_.rings.points, input_.rings.offsets,
                        input_.placed.roots, input_.scale.cell_size, scratch_.interior);
  }
  FindShapes();
  const Fill fill = input_.parameters.fill;
  const bool has_band = fill != Fill::kNone && fill != Fill::kPolygon;
  if (fill != Fill::kNone) {
    scratch_.loops.Clear();
    CollectRingPoints();
    AddRingLoops();
    if (has_band) {
      AddNodes();
      AddStaircaseLoops(true);
    }
    if (absl::Status status = TriangulateLoops(TriangleClass::kBoundary); !status.ok()) {
      return status;
    }
    if (absl::Status status = FillInterior(); !status.ok()) return status;
    if (MovesVertices()) MoveVertices();
  }
  const auto band_triangles =
      has_band ? static_cast<std::uint64_t>(std::count(mesh_.classes.begin(), mesh_.classes.end(),
                                                       TriangleClass::kBoundary))
               : ExpectedBandTriangles();
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
