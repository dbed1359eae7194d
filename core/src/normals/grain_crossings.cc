#include "normals/grain_crossings.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace partiemc {
namespace {

constexpr std::size_t kCrossingsAtOnce = 64;

// The search ends at this value of F, in cells, or after this number of samples.
constexpr double kTolerance = 1e-4;
constexpr int kMostSamples = 8;

// An end of the stretch that contains the root: its place on the edge, from 0 to 1, and F.
struct End {
  double place, value;
};

// Finds the root of F between the ends of an edge by false position. If the same end stays twice,
// its value is halved (the Illinois algorithm).
template <typename Sample>
double RootBetween(End low, End high, Sample sample) {
  double place = 0;
  int kept = 0;  // The end that stayed last: -1 low, 1 high.
  for (int k = 0; k < kMostSamples; ++k) {
    const double share = low.value / (low.value - high.value);
    const double last = place;
    place = std::clamp(low.place + std::clamp(share, 0.0, 1.0) * (high.place - low.place),
                       kEdgeMargin, 1 - kEdgeMargin);
    if (place == last) break;  // The root is next to a node.
    const double value = sample(place);
    if (std::abs(value) < kTolerance) break;
    const bool is_low = (value < 0) == (low.value < 0);
    (is_low ? low : high) = {place, value};
    const int stays = is_low ? 1 : -1;
    if (stays == kept) (is_low ? high : low).value /= 2;
    kept = stays;
  }
  return place;
}

}  // namespace

void FindGrainCrossings(const TileDirectory& directory, const LevelSet& level_set,
                        const Crossings& crossings, const LevelSetSampler& field,
                        RingTopology& rings) {
  ParallelForRanges(
      rings.segments.size(), kCrossingsAtOnce, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
          const Segment& segment = crossings.segments[rings.segments[k]];
          const ActiveCell& cell = crossings.cells[segment.cell];
          const int along_x = ~segment.entry & 1, along_y = segment.entry & 1;
          const int i = cell.i + (segment.entry == 1), j = cell.j + (segment.entry == 2);
          const double place = RootBetween(
              {0, level_set.At(directory, cell.tile, i, j)},
              {1, level_set.At(directory, cell.tile, i + along_x, j + along_y)}, [&](double at) {
                return field.Sample(cell.tile, i + along_x * at, j + along_y * at).value;
              });
          const Point origin = CellOrigin(directory, cell);
          rings.entry_points[k] = {origin.x - cell.i + (i + along_x * place),
                                   origin.y - cell.j + (j + along_y * place)};
        }
      });
}

}  // namespace partiemc
