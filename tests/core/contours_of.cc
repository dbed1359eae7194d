// Contours of level sets that another program made, for comparison with its own
// (check_contours.py). Reads lattices from standard input: columns and rows as 32-bit integers,
// then columns * rows floats, row by row; nodes outside of a lattice are outside of the isoline.
// Writes one line of JSON for each: "rings" as lists of x, y, x, y, ... in cells, "outer_of" as in
// Rings, with -1 for outer rings, and "segments" as lists of column, row, entry edge, exit edge.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>

#include "support/level_sets.h"
#include "support/stages.h"

namespace partiemc {
namespace {

// A lattice lies round the corner of four tiles.
constexpr int kOffset = 20;
constexpr int kMaxSize = 40;

bool Read(support::LevelSetPatch& patch) {
  std::int32_t size[2];
  if (std::fread(size, sizeof(size), 1, stdin) != 1) return false;
  const auto [columns, rows] = size;
  if (columns < 1 || rows < 1 || columns > kMaxSize || rows > kMaxSize) return false;
  patch = {columns, rows, std::vector<float>(static_cast<std::size_t>(columns * rows))};
  return std::fread(patch.values.data(), sizeof(float), patch.values.size(), stdin) ==
         patch.values.size();
}

void WriteRings(const Rings& rings) {
  std::printf("{\"rings\":[");
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    std::printf(ring == 0 ? "[" : ",[");
    const std::span<const double> points = rings.RingPoints(ring);
    for (std::size_t k = 0; k < points.size(); ++k) {
      std::printf(k == 0 ? "%.17g" : ",%.17g", points[k] - kOffset);
    }
    std::printf("]");
  }
  std::printf("],\"outer_of\":[");
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const bool is_outer = rings.outer_of[ring] == kNoRing;
    std::printf(ring == 0 ? "%d" : ",%d", is_outer ? -1 : static_cast<int>(rings.outer_of[ring]));
  }
}

void WriteSegments(const support::Stages& stages) {
  std::printf("],\"segments\":[");
  const char* separator = "";
  for (const Segment& segment : stages.crossings.segments) {
    const Point cell = CellOrigin(stages.bins.tiles, stages.crossings.cells[segment.cell]);
    std::printf("%s[%d,%d,%d,%d]", separator, static_cast<int>(cell.x) - kOffset,
                static_cast<int>(cell.y) - kOffset, segment.entry, segment.exit);
    separator = ",";
  }
  std::printf("]}\n");
}

int Main() {
  support::LevelSetPatch patch;
  support::Stages stages;
  while (Read(patch)) {
    stages.RunOn([&](int x, int y) { return patch.At(x - kOffset, y - kOffset); }, {0, 0}, {1, 1},
                 {},
                 {.placement = Placement::kMarchingSquares,
                  .fill = Fill::kNone,
                  .spacing = 1.0,
                  .clean = false});
    if (testing::Test::HasFailure()) return 1;
    WriteRings(stages.result.rings);
    WriteSegments(stages);
  }
  return std::feof(stdin) != 0 ? 0 : 1;
}

}  // namespace
}  // namespace partiemc

int main() { return partiemc::Main(); }
