#include "mesh/blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "bins/cell_mask.h"

namespace partiemc {
namespace {

constexpr int kNodesAlong = kTileSize + 1;

// The cells [i, i + side) of a row.
std::uint32_t Span(int i, int side) {
  return side == kTileSize ? ~std::uint32_t{0} : ((std::uint32_t{1} << side) - 1) << i;
}

bool HasAll(const BitRows& cells, int i, int j, int side) {
  const std::uint32_t span = Span(i, side);
  for (int row = j; row < j + side; ++row) {
    if ((cells[row] & span) != span) return false;
  }
  return true;
}

void SetBlock(BitRows& cells, int i, int j, int side, bool value) {
  const std::uint32_t span = Span(i, side);
  for (int row = j; row < j + side; ++row) {
    cells[row] = value ? cells[row] | span : cells[row] & ~span;
  }
}

// Calls visit(i, j) for each block of a level whose first cell is in `cells`.
template <typename Visit>
void ForEachBlockIn(const BitRows& cells, int level, const Visit& visit) {
  const int side = 1 << level;
  for (int j = 0; j < kTileSize; j += side) {
    for (int i = 0; i < kTileSize; i += side) {
      if ((cells[j] >> i & 1) != 0) visit(i, j);
    }
  }
}

// The values of one part of an attribute at the nodes of a tile, including its right and upper
// side.
using TileValues = std::array<std::array<float, kNodesAlong>, kNodesAlong>;

// The parts of an attribute: its components, and the length of a vector. Pictures are coloured by
// the length, which is not linear near a zero of a linear vector field.
int PartsOf(const AttributeValues& attribute) {
  return attribute.components == 1 ? 1 : attribute.components + 1;
}

float PartOf(const AttributeValues& attribute, std::size_t node, int part) {
  const float* const components = &attribute.values[node * attribute.components];
  if (part < attribute.components) return components[part];
  double sum = 0;
  for (int c = 0; c < attribute.components; ++c) sum += double{components[c]} * components[c];
  return static_cast<float>(std::min<double>(std::sqrt(sum), std::numeric_limits<float>::max()));
}

void Gather(const TileDirectory& directory, const NodeAttributes& attributes, std::uint32_t tile,
            const AttributeValues& attribute, int part, TileValues& values) {
  for (int j = 0; j < kNodesAlong; ++j) {
    for (int i = 0; i < kNodesAlong; ++i) {
      const TilePlace node = Normalise(directory, tile, i, j);
      if (node.tile == kNoTile || !attributes.nodes.Contains(node)) continue;
      values[j][i] = PartOf(attribute, attributes.nodes.At(node), part);
    }
  }
}

// Let D be the largest deviation of a node from the bilinear interpolation of the corners, and T
// the distance of the two diagonals in the centre. Triangles between corners and middles of edges
// deviate from the bilinear interpolation by at most T / 2 + D: T / 2 for the diagonals, D at the
// middles. So they deviate from a node by at most 2 D + T / 2.
bool IsLinear(const TileValues& values, int i, int j, int side, double tolerance) {
  const double a = values[j][i], b = values[j][i + side];
  const double c = values[j + side][i], d = values[j + side][i + side];
  const double apart = std::abs(a + d - b - c) / 2;
  if (apart / 2 > tolerance) return false;
  const double most = (tolerance - apart / 2) / 2;
  for (int y = 0; y <= side; ++y) {
    const double v = static_cast<double>(y) / side;
    const double left = a + (c - a) * v, right = b + (d - b) * v;
    for (int x = 0; x <= side; ++x) {
      const double u = static_cast<double>(x) / side;
      if (!(std::abs(values[j + y][i + x] - (left + (right - left) * u)) <= most)) return false;
    }
  }
  return true;
}

// A vector's tolerance is a fraction of the range of the component that varies most.
double RangeOf(const AttributeValues& attribute) {
  double range = 0;
  for (int c = 0; c < attribute.components; ++c) {
    double least = INFINITY, most = -INFINITY;
    for (std::size_t k = c; k < attribute.values.size(); k += attribute.components) {
      least = std::min<double>(least, attribute.values[k]);
      most = std::max<double>(most, attribute.values[k]);
    }
    range = std::max(range, most - least);
  }
  return range;
}

void FindInteriorBlocks(const BitRows& interior, Blocks::Levels& levels) {
  levels[0] = interior;
  for (int level = 1; level < kBlockLevels; ++level) {
    levels[level] = {};
    ForEachBlockIn(levels[level - 1], level, [&](int i, int j) {
      const int side = 1 << level;
      if (HasAll(levels[level - 1], i, j, side)) SetBlock(levels[level], i, j, side, true);
    });
  }
}

void KeepLinearBlocks(const TileValues& values, double tolerance, Blocks::Levels& levels) {
  for (int level = 1; level < kBlockLevels; ++level) {
    ForEachBlockIn(levels[level], level, [&](int i, int j) {
      const int side = 1 << level;
      if (!HasAll(levels[level - 1], i, j, side) || !IsLinear(values, i, j, side, tolerance)) {
        SetBlock(levels[level], i, j, side, false);
      }
    });
  }
}

// Interior cells whose blocks are smaller than a level.
class SmallerCells {
 public:
  SmallerCells(const TileDirectory& directory, const Blocks& blocks, int level)
      : directory_(directory), blocks_(blocks), level_(level) {}

  // Whether one of the cells along the four edges of a block is smaller.
  bool Beside(std::uint32_t tile, int i, int j, int side) const {
    const std::uint32_t span = Span(i, side);
    if ((Row(tile, i, j - 1) & span) != 0 || (Row(tile, i, j + side) & span) != 0) return true;
    for (int row = j; row < j + side; ++row) {
      if (Has(tile, i - 1, row) || Has(tile, i + side, row)) return true;
    }
    return false;
  }

 private:
  std::uint32_t Row(std::uint32_t tile, int i, int j) const {
    const TilePlace place = Normalise(directory_, tile, i, j);
    if (place.tile == kNoTile) return 0;
    const Blocks::Levels& levels = blocks_.at_least[place.tile];
    return levels[0][place.j] & ~levels[level_][place.j];
  }
  bool Has(std::uint32_t tile, int i, int j) const {
    return (Row(tile, i, j) >> (i & (kTileSize - 1)) & 1) != 0;
  }

  const TileDirectory& directory_;
  const Blocks& blocks_;
  const int level_;
};

}  // namespace

void FindBlocks(const TileDirectory& directory, std::span<const BitRows> interior,
                const NodeAttributes& attributes, Blocks& blocks) {
  blocks.linear.resize(interior.size());
  blocks.at_least.assign(interior.size(), {});
  ParallelFor(interior.size(), [&](std::size_t tile) {
    FindInteriorBlocks(interior[tile], blocks.linear[tile]);
    blocks.at_least[tile][0] = interior[tile];
  });
  for (const AttributeValues& attribute : attributes.values) {
    const double tolerance = attributes.tolerance * RangeOf(attribute);
    for (int part = 0; part < PartsOf(attribute); ++part) {
      ParallelFor(interior.size(), [&](std::size_t k) {
        const auto tile = static_cast<std::uint32_t>(k);
        if (IsEmpty(blocks.linear[tile][1])) return;
        TileValues values{};
        Gather(directory, attributes, tile, attribute, part, values);
        KeepLinearBlocks(values, tolerance, blocks.linear[tile]);
      });
    }
  }
  for (int level = 1; level < kBlockLevels; ++level) {
    const SmallerCells smaller(directory, blocks, level - 1);
    ParallelFor(interior.size(), [&](std::size_t k) {
      const auto tile = static_cast<std::uint32_t>(k);
      Blocks::Levels& levels = blocks.at_least[tile];
      ForEachBlockIn(blocks.linear[tile][level], level, [&](int i, int j) {
        const int side = 1 << level;
        if (HasAll(levels[level - 1], i, j, side) && !smaller.Beside(tile, i, j, side)) {
          SetBlock(levels[level], i, j, side, true);
        }
      });
    });
  }
}

}  // namespace partiemc
