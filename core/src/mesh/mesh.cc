#include "mesh/mesh.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "base/bits.h"
#include "base/parallel.h"
#include "base/predicates.h"
#include "frame/placement_traits.h"
#include "mesh/touched_cells.h"

namespace partiemc {
namespace {

// Builds one mesh. Points of the connectivity: the points of the rings (for `farthest-particle`:
// the middles of all segments), then the nodes of the lattice that triangles name. While loops are
// triangulated, the corners of the staircases stand in for these.
class MeshBuilder {
 public:
  MeshBuilder(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
              std::vector<std::uint32_t>& tangled)
      : input_(input), scratch_(scratch), mesh_(mesh), tangled_(tangled) {}

  void Build(FrameStatistics& statistics);

 private:
  bool MovesVertices() const { return TraitsOf(input_.parameters.placement).takes_particles; }
  bool HasBand() const {
    return input_.parameters.fill != Fill::kNone && input_.parameters.fill != Fill::kPolygon;
  }
  void FindInterior();
  void CollectRingPoints();
  template <typename Visit>
  void ForEachRectangle(Visit visit) const;
  void FillRectangles();
  void NumberCorners();
  void AppendNodes();
  void AppendCorners();
  void PutNodesInPlace();
  void AddRingLoops();
  void AddStaircaseLoops(bool reversed);
  std::uint32_t OuterRingAt(const TilePlace& inside_node) const;
  void TriangulateLoops(TriangleClass triangle_class);
  void TriangulateByLoops();
  void TriangulateAll();
  void MoveVertices();
  std::uint64_t CountInteriorCells() const;
  std::uint64_t ExpectedBandTriangles() const;
  std::uint64_t CountFolded() const;

  const MeshInput& input_;
  MeshScratch& scratch_;
  Mesh& mesh_;
  std::vector<std::uint32_t>& tangled_;
  std::size_t ring_points_ = 0;  // Points of the connectivity that belong to rings.
  std::uint64_t interior_cells_ = 0;
};

void MeshBuilder::FindInterior() {
  scratch_.interior = input_.crossings.interior;
  if (!TraitsOf(input_.parameters.placement).refines) return;
  ExcludeTouchedCells(input_.directory, input_.rings.points, input_.rings.offsets,
                      input_.placed.roots, input_.scale.cell_size, scratch_.interior);
}

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

// Numbers the nodes that rectangles have and makes two triangles of each. Every corner of
// a staircase is among these nodes: a rectangle that is next to a node without having its corner
// there has two neighbours, or all, of the four cells around it. Those around a corner, one or
// three that are interior, or two across from each other, cannot be paired like that.
void MeshBuilder::FillRectangles() {
  scratch_.rectangles.clear();
  if (input_.parameters.fill == Fill::kGreedy) {
    MergeCells(input_.directory, scratch_.interior, scratch_.merge, scratch_.rectangles);
  }
  interior_cells_ = CountInteriorCells();
  NodeVertices& nodes = scratch_.nodes;
  nodes.Clear(input_.directory.size());
  ForEachRectangle([&](const CellRectangle& rectangle) {
    for (const TilePlace& corner : CornersOf(input_.directory, rectangle)) nodes.Add(corner);
  });
  nodes.Number(static_cast<std::uint32_t>(ring_points_));
  scratch_.triangles.resize(
      6 * (input_.parameters.fill == Fill::kGrid ? interior_cells_ : scratch_.rectangles.size()));
  std::uint32_t* next = scratch_.triangles.data();
  ForEachRectangle([&](const CellRectangle& rectangle) {
    std::array<std::uint32_t, 4> corners;
    std::ranges::transform(CornersOf(input_.directory, rectangle), corners.begin(),
                           [&](const TilePlace& node) { return nodes.At(node); });
    for (const int corner : {0, 1, 2, 0, 2, 3}) *next++ = corners[corner];
  });
}

// The number of the node of each corner of the staircases.
void MeshBuilder::NumberCorners() {
  const std::vector<TilePlace>& corners = scratch_.staircases.corners;
  NodeVertices& nodes = scratch_.nodes;
  if (input_.parameters.fill == Fill::kConforming) {
    for (const TilePlace& corner : corners) nodes.Add(corner);
    nodes.Number(static_cast<std::uint32_t>(ring_points_));
  }
  scratch_.corner_numbers.resize(corners.size());
  if (!HasBand()) return;
  std::ranges::transform(corners, scratch_.corner_numbers.begin(),
                         [&](const TilePlace& node) { return nodes.At(node); });
}

void MeshBuilder::AppendNodes() {
  scratch_.nodes.AppendPoints(input_.directory, input_.scale.cell_size, mesh_.points);
}

// Appends the corners of the staircases to the points; a node that loops pass twice comes twice.
void MeshBuilder::AppendCorners() {
  const std::vector<TilePlace>& corners = scratch_.staircases.corners;
  for (const TilePlace& corner : corners) {
    const Point point = NodePoint(input_.directory, corner, input_.scale.cell_size);
    mesh_.points.insert(mesh_.points.end(), {point.x, point.y});
  }
  scratch_.corner_numbers.resize(corners.size());
  std::iota(scratch_.corner_numbers.begin(), scratch_.corner_numbers.end(),
            static_cast<std::uint32_t>(ring_points_));
}

// Puts the nodes in the place of the corners of the staircases.
void MeshBuilder::PutNodesInPlace() {
  NumberCorners();
  mesh_.points.resize(2 * ring_points_);
  const auto renumber = [this] {
    if (scratch_.corner_numbers.empty()) return;  // Then no triangle has one.
    const auto first = static_cast<std::uint32_t>(ring_points_);
    for (std::uint32_t& point : mesh_.triangles) {
      // Without a branch: of a triangle's points, nobody guesses which are corners.
      const bool is_corner = point >= first;
      const std::uint32_t number = scratch_.corner_numbers[is_corner ? point - first : 0];
      point = is_corner ? number : point;
    }
  };
  ParallelInvoke(renumber, [this] { AppendNodes(); });
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
  const RingTopology& rings = input_.topology;
  return rings.outer_ring[rings.components.At(input_.crossings, inside_node)];
}

void MeshBuilder::AddStaircaseLoops(bool reversed) {
  const Staircases& staircases = scratch_.staircases;
  const std::size_t count = staircases.offsets.size() - 1;
  // The corners of interior cells are inside, in one component: cells stay on their side of every
  // ring, or were excluded. Looked up for all loops in a row, as each waits for memory.
  scratch_.staircase_rings.resize(count);
  for (std::size_t loop = 0; loop < count; ++loop) {
    scratch_.staircase_rings[loop] = OuterRingAt(staircases.corners[staircases.offsets[loop]]);
  }
  const std::span<const std::uint32_t> numbers = scratch_.corner_numbers;
  for (std::size_t loop = 0; loop < count; ++loop) {
    const std::uint32_t first = staircases.offsets[loop];
    scratch_.loops.AddPoints(numbers.subspan(first, staircases.offsets[loop + 1] - first));
    scratch_.loops.EndLoop(scratch_.staircase_rings[loop], reversed);
  }
}

void MeshBuilder::TriangulateLoops(TriangleClass triangle_class) {
  scratch_.loops.Triangulate(mesh_.points, mesh_.triangles, tangled_);
  mesh_.classes.resize(mesh_.triangles.size() / 3, triangle_class);
}

// What rings and staircases bound: the band between them, all of the inside for `polygon`, and for
// `conforming` the interior, as the corners of the staircases are the only points that the band has
// there.
void MeshBuilder::TriangulateByLoops() {
  scratch_.loops.Clear();
  AddRingLoops();
  if (HasBand()) AddStaircaseLoops(true);
  TriangulateLoops(TriangleClass::kBoundary);
  if (input_.parameters.fill != Fill::kConforming) return;
  AddStaircaseLoops(false);
  TriangulateLoops(TriangleClass::kInterior);
}

// Finds the shapes of the interior and triangulates everything. The rectangles have a thread of
// their own where there are several: one long ring is swept by one.
void MeshBuilder::TriangulateAll() {
  const auto sweep = [this] {
    TraceStaircases(input_.directory, scratch_.interior, scratch_.staircases);
    AppendCorners();
    TriangulateByLoops();
  };
  ParallelInvoke(sweep, [this] { FillRectangles(); });
  PutNodesInPlace();
  mesh_.triangles.insert(mesh_.triangles.end(), scratch_.triangles.begin(),
                         scratch_.triangles.end());
  mesh_.classes.resize(mesh_.triangles.size() / 3, TriangleClass::kInterior);
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
  if (input_.parameters.fill == Fill::kGreedy) {
    for (const CellRectangle& rectangle : scratch_.rectangles) {
      count += static_cast<std::uint64_t>(rectangle.width) *
               static_cast<std::uint64_t>(rectangle.height);
    }
    return count;
  }
  for (const BitRows& rows : scratch_.interior) {
    for (const std::uint32_t row : rows) count += CountBits(row);
  }
  return count;
}

// Triangles of the band by Euler's formula: n - 2 chi, where chi of the band is that of the rings'
// inside less that of the interior cells.
std::uint64_t MeshBuilder::ExpectedBandTriangles() const {
  const Staircases& staircases = scratch_.staircases;
  std::int64_t rings = 0;
  for (const std::uint32_t outer : input_.topology.outer_of) rings += outer == kNoRing ? 1 : -1;
  const std::size_t points = input_.rings.PointCount() + staircases.corners.size();
  return static_cast<std::uint64_t>(
      static_cast<std::int64_t>(points) -
      2 * (rings - EulerCharacteristic(input_.directory, staircases)));
}

std::uint64_t MeshBuilder::CountFolded() const {
  const auto point = [this](std::uint32_t index) { return PointAt(mesh_.points, index); };
  std::uint64_t count = 0;
  for (std::size_t k = 0; k < mesh_.triangles.size(); k += 3) {
    count += Orientation(point(mesh_.triangles[k]), point(mesh_.triangles[k + 1]),
                         point(mesh_.triangles[k + 2])) <= 0;
  }
  return count;
}

void MeshBuilder::Build(FrameStatistics& statistics) {
  mesh_.Clear();
  tangled_.clear();
  FindInterior();
  if (input_.parameters.fill == Fill::kNone) {
    TraceStaircases(input_.directory, scratch_.interior, scratch_.staircases);
    interior_cells_ = CountInteriorCells();
  } else {
    CollectRingPoints();
    TriangulateAll();
    if (!tangled_.empty()) return;
    if (MovesVertices()) MoveVertices();
  }
  const auto band_triangles =
      HasBand() ? static_cast<std::uint64_t>(std::count(mesh_.classes.begin(), mesh_.classes.end(),
                                                        TriangleClass::kBoundary))
                : ExpectedBandTriangles();
  statistics.triangles = mesh_.TriangleCount();
  statistics.triangles_grid = 2 * interior_cells_ + band_triangles;
  statistics.folded_triangles = MovesVertices() ? CountFolded() : 0;
}

}  // namespace

void BuildMesh(const MeshInput& input, MeshScratch& scratch, Mesh& mesh,
               FrameStatistics& statistics, std::vector<std::uint32_t>& tangled) {
  MeshBuilder(input, scratch, mesh, tangled).Build(statistics);
}

}  // namespace partiemc
