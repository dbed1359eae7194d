#include "mesh/mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <ostream>
#include <set>

#include "base/predicates.h"
#include "partiemc/validate.h"
#include "support/reconstruct.h"
#include "support/stages.h"

namespace partiemc {
namespace {

using support::Particles;
using support::ReconstructOnce;

struct NamedParticles {
  std::string name;
  Particles particles;

  friend void PrintTo(const NamedParticles& scene, std::ostream* out) { *out << scene.name; }
};

std::vector<NamedParticles> Scenes() {
  support::Random random(1);
  Particles spray = support::Blob(random, 9);
  spray.Add(support::Noise(random, 40, 30));
  return {{"Disc", support::Disc(11.3)},
          {"Annulus", support::Annulus(4, 9)},
          {"Lattice", support::Lattice(34, 20)},
          {"AcrossTheOrigin", support::Shifted(support::Lattice(60, 7), -31, -3)},
          {"Blob", support::Blob(random, 12)},
          {"Spray", spray},
          {"Sheet", support::Sheet(random, 40)},
          {"Lone", support::Lattice(1, 1, 5, 5)}};
}

class MeshOf : public testing::TestWithParam<std::tuple<NamedParticles, Placement>> {
 protected:
  const NamedParticles& scene() const { return std::get<0>(GetParam()); }
  Placement placement() const { return std::get<1>(GetParam()); }
  bool IsFarthest() const { return !KeepsGuarantees(placement()); }
  Result With(Fill fill) const {
    return ReconstructOnce({.placement = placement(), .fill = fill, .spacing = 1.0},
                           scene().particles);
  }
};

TEST_P(MeshOf, EveryFillKeepsTheGuarantees) {
  for (const Fill fill : AllFills()) {
    const Result result = With(fill);
    if (!IsFarthest()) {
      EXPECT_EQ(Validate(result, fill), absl::OkStatus()) << Name(fill);
    }
    EXPECT_EQ(result.statistics.triangles, result.mesh.TriangleCount());
    EXPECT_EQ(result.mesh.triangles.size(), 3 * result.mesh.classes.size());
    EXPECT_EQ(result.mesh.points.empty(), fill == Fill::kNone || result.rings.RingCount() == 0);
    for (const std::uint32_t index : result.mesh.triangles) {
      ASSERT_LT(index, result.mesh.PointCount());
    }
  }
}

TEST_P(MeshOf, NoFillChangesARingByABit) {
  const Result none = With(Fill::kNone);
  for (const Fill fill : AllFills()) {
    const Result result = With(fill);
    EXPECT_EQ(result.rings, none.rings);
    EXPECT_EQ(DigestRings(result.rings), DigestRings(none.rings));
    if (fill == Fill::kNone) continue;
    ASSERT_GE(result.mesh.points.size(), none.rings.points.size());
    EXPECT_TRUE(
        std::equal(none.rings.points.begin(), none.rings.points.end(), result.mesh.points.begin()));
  }
}

TEST_P(MeshOf, EveryFillReportsTrianglesOfGrid) {
  const std::uint64_t grid = With(Fill::kGrid).mesh.TriangleCount();
  for (const Fill fill : AllFills()) {
    const Result result = With(fill);
    // The collapsed triangles of farthest-particle are known only after the mesh was made.
    if (IsFarthest() && (fill == Fill::kNone || fill == Fill::kPolygon)) continue;
    EXPECT_EQ(result.statistics.triangles_grid, grid) << Name(fill);
  }
}

using Triangle = std::array<std::pair<double, double>, 3>;

std::set<Triangle> TrianglesOf(const Mesh& mesh, TriangleClass wanted) {
  std::set<Triangle> triangles;
  for (std::size_t k = 0; k < mesh.TriangleCount(); ++k) {
    if (mesh.classes[k] != wanted) continue;
    Triangle triangle;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t point = mesh.triangles[3 * k + c];
      triangle[c] = {mesh.points[2 * point], mesh.points[2 * point + 1]};
    }
    triangles.insert(triangle);
  }
  return triangles;
}

TEST_P(MeshOf, BandIsTheSameForGridGreedyAndConforming) {
  const auto grid = TrianglesOf(With(Fill::kGrid).mesh, TriangleClass::kBoundary);
  EXPECT_EQ(TrianglesOf(With(Fill::kGreedy).mesh, TriangleClass::kBoundary), grid);
  EXPECT_EQ(TrianglesOf(With(Fill::kConforming).mesh, TriangleClass::kBoundary), grid);
}

TEST_P(MeshOf, PolygonHasNoInteriorVertex) {
  const Result result = With(Fill::kPolygon);
  EXPECT_EQ(result.mesh.points, result.rings.points);
  EXPECT_EQ(
      std::count(result.mesh.classes.begin(), result.mesh.classes.end(), TriangleClass::kInterior),
      0);
}

TEST_P(MeshOf, FoldedTrianglesAreCounted) {
  for (const Fill fill : AllFills()) {
    const Result result = With(fill);
    std::uint64_t folded = 0;
    for (std::size_t k = 0; k < result.mesh.triangles.size(); k += 3) {
      const auto point = [&](std::size_t c) {
        const std::uint32_t index = result.mesh.triangles[k + c];
        return Point{result.mesh.points[2 * index], result.mesh.points[2 * index + 1]};
      };
      folded += Orientation(point(0), point(1), point(2)) <= 0;
    }
    EXPECT_EQ(result.statistics.folded_triangles, folded) << Name(fill);
    EXPECT_TRUE(folded == 0 || IsFarthest());
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, MeshOf,
                         testing::Combine(testing::ValuesIn(Scenes()),
                                          testing::ValuesIn(AllPlacements())),
                         [](const auto& tested) {
                           std::string name(Name(std::get<1>(tested.param)));
                           std::erase(name, '-');
                           return std::get<0>(tested.param).name + name;
                         });

TEST(Mesh, GridHasTwoTrianglesForEachInteriorCellAndGreedyFewer) {
  support::Stages stages;
  stages.Run(support::Lattice(34, 67), {.fill = Fill::kGrid, .spacing = 1.0});
  std::size_t cells = 0;
  for (const BitRows& rows : stages.mesh_scratch.interior) {
    for (const std::uint32_t row : rows) cells += std::popcount(row);
  }
  const auto& classes = stages.result.mesh.classes;
  EXPECT_EQ(std::count(classes.begin(), classes.end(), TriangleClass::kInterior),
            static_cast<std::ptrdiff_t>(2 * cells));
  const Result greedy =
      ReconstructOnce({.fill = Fill::kGreedy, .spacing = 1.0}, support::Lattice(34, 67));
  EXPECT_LT(4 * greedy.statistics.triangles, greedy.statistics.triangles_grid);
}

// Random interior cells, dense and sparse, over several tiles.
class GreedyRectangles : public testing::TestWithParam<int> {};

TEST_P(GreedyRectangles, AreDisjointAndCoverTheInteriorCellsExactly) {
  support::Random random(static_cast<std::uint64_t>(GetParam()));
  TileDirectory directory;
  for (std::int32_t y = -1; y <= 1; ++y) {
    for (std::int32_t x = -1; x <= 1; ++x) {
      if (!random.Chance(0.1)) directory.Insert({y, x});
    }
  }
  directory.Seal();
  std::vector<BitRows> interior(directory.size());
  const double density = random.Uniform(0.5, 1);
  for (BitRows& rows : interior) {
    for (std::uint32_t& row : rows) {
      for (int i = 0; i < 32; ++i) row |= std::uint32_t{random.Chance(density)} << i;
    }
  }
  MergeScratch scratch;
  std::vector<CellRectangle> rectangles;
  MergeCells(directory, interior, scratch, rectangles);
  std::map<std::pair<std::int64_t, std::int64_t>, int> covered;
  for (const CellRectangle& r : rectangles) {
    ASSERT_GT(r.width, 0);
    ASSERT_GT(r.height, 0);
    const TileCoordinate& tile = directory[r.corner.tile];
    for (int y = 0; y < r.height; ++y) {
      for (int x = 0; x < r.width; ++x) {
        ++covered[{32 * tile.x + r.corner.i + x, 32 * tile.y + r.corner.j + y}];
      }
    }
  }
  std::size_t cells = 0;
  for (std::size_t tile = 0; tile < interior.size(); ++tile) {
    for (int j = 0; j < 32; ++j) {
      for (int i = 0; i < 32; ++i) {
        if ((interior[tile][j] >> i & 1) == 0) continue;
        ++cells;
        EXPECT_EQ((covered[{32 * directory[tile].x + i, 32 * directory[tile].y + j}]), 1);
      }
    }
  }
  EXPECT_EQ(covered.size(), cells);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GreedyRectangles, testing::Range(1, 11));

TEST(Mesh, RectangleAcrossTilesStaysWhole) {
  TileDirectory directory;
  for (std::int32_t y = 0; y <= 2; ++y) {
    for (std::int32_t x = 0; x <= 2; ++x) directory.Insert({y, x});
  }
  directory.Seal();
  std::vector<BitRows> interior(directory.size());
  for (std::size_t tile = 0; tile < interior.size(); ++tile) {
    for (int j = 0; j < 32; ++j) {
      for (int i = 0; i < 32; ++i) {
        const int x = 32 * directory[tile].x + i;
        const int y = 32 * directory[tile].y + j;
        if (x >= 20 && x < 70 && y >= 10 && y < 80) {
          interior[tile][j] |= std::uint32_t{1} << i;
        }
      }
    }
  }
  MergeScratch scratch;
  std::vector<CellRectangle> rectangles;
  MergeCells(directory, interior, scratch, rectangles);
  ASSERT_EQ(rectangles.size(), 1u);
  EXPECT_EQ(directory[rectangles[0].corner.tile], (TileCoordinate{0, 0}));
  EXPECT_EQ(rectangles[0].corner.i, 20);
  EXPECT_EQ(rectangles[0].corner.j, 10);
  EXPECT_EQ(rectangles[0].width, 50);
  EXPECT_EQ(rectangles[0].height, 70);
  Staircases staircases;
  TraceStaircases(directory, interior, nullptr, staircases);
  EXPECT_EQ(staircases.corners.size(), 4u);
  EXPECT_EQ(staircases.pinches, 0u);
}

TEST(Mesh, DiagonalCellsMakeAPinch) {
  TileDirectory directory;
  directory.Insert({0, 0});
  directory.Seal();
  for (const bool rising : {true, false}) {
    std::vector<BitRows> interior(1);
    interior[0][5] = rising ? 1u << 5 : 1u << 6;
    interior[0][6] = rising ? 1u << 6 : 1u << 5;
    Staircases staircases;
    TraceStaircases(directory, interior, nullptr, staircases);
    EXPECT_EQ(staircases.offsets, (std::vector<std::uint32_t>{0, 4, 8}));
    EXPECT_EQ(staircases.pinches, 1u);
  }
}

}  // namespace
}  // namespace partiemc
