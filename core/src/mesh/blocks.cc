#include "mesh/blocks.h"

#include <algorithm>
#include <cmath>

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

// Blocks of at least this level are tested at few nodes, and by the particles in windows. The side
// of a window is half the side of the smallest such block.
constexpr int kLevelOfWindows = 3;
constexpr int kWindowShift = kLevelOfWindows - 1;
constexpr int kWindowsAlong = kTileSize >> kWindowShift;
constexpr int kWindowsOfTile = kWindowsAlong * kWindowsAlong;

// Distance of the nodes at which a block is tested.
int StepOf(int level) { return level >= kLevelOfWindows ? 1 << (level - 1) : 1; }

// Number of parts of an attribute. A part is a component, or the length of a vector. The length is
// tested, too, because pictures are coloured by it, and it is not linear near a zero of a linear
// vector field.
int PartsOf(int components) { return components == 1 ? 1 : components + 1; }

double PartOf(const float* value, int components, int part) {
  if (part < components) return value[part];
  double sum = 0;
  for (int c = 0; c < components; ++c) sum += double{value[c]} * value[c];
  return std::sqrt(sum);
}

// Number of moments of a window: the number of its particles, and the sums of x, y and x y in cells
// of the tile. The sums of the values of all parts follow.
constexpr std::size_t kWindowMoments = 4;

// The bilinear interpolation of the corners of a block at (i, j).
class CornerInterpolation {
 public:
  CornerInterpolation(double a, double b, double c, double d, int i, int j, int side)
      : a_(a), right_(b - a), up_(c - a), twist_(a + d - b - c), i_(i), j_(j), side_(side) {}

  double At(int x, int y) const {
    const double u = (x - i_) / side_, v = (y - j_) / side_;
    return a_ + right_ * u + up_ * v + twist_ * u * v;
  }
  // The sum of the interpolation over the particles of a window, by their moments.
  double SumOver(const double* moments) const {
    const auto [n, x, y, xy] = std::array{moments[0], moments[1], moments[2], moments[3]};
    const double u = (x - i_ * n) / side_, v = (y - j_ * n) / side_;
    const double uv = (xy - i_ * y - j_ * x + i_ * j_ * n) / (side_ * side_);
    return a_ * n + right_ * u + up_ * v + twist_ * uv;
  }
  // In the centre: the difference of the interpolations along the two diagonals.
  double DistanceOfDiagonals() const { return std::abs(twist_) / 2; }

 private:
  double a_, right_, up_, twist_, i_, j_, side_;
};

// Tests the blocks of one level in which attributes may be linear.
class LevelTest {
 public:
  LevelTest(const TileDirectory& directory, const AttributeSource& attributes, int level,
            Blocks& blocks)
      : directory_(directory), attributes_(attributes), level_(level), blocks_(blocks) {
    for (const Attribute& attribute : attributes.frame.attributes) {
      parts_ += PartsOf(attribute.components);
    }
  }

  void Run(double cell_size) {
    NodeVertices& nodes = blocks_.nodes;
    nodes.Clear(directory_.size());
    bool has_blocks = false;
    for (std::uint32_t tile = 0; tile < directory_.size(); ++tile) {
      ForEachBlockIn(blocks_.linear[tile][level_], level_, [&](int i, int j) {
        has_blocks = true;
        ForEachNode(tile, i, j, [&](int, int, const TilePlace& node) { nodes.Add(node); });
      });
    }
    if (!has_blocks) return;
    nodes.Number(0);
    blocks_.node_points.clear();
    nodes.AppendPoints(directory_, cell_size, blocks_.node_points);
    values_ = attributes_.at_points(blocks_.node_points);
    ParallelFor(directory_.size(), [&](std::size_t tile) {
      BitRows& candidates = blocks_.linear[tile][level_];
      ForEachBlockIn(candidates, level_, [&](int i, int j) {
        if (!IsLinear(static_cast<std::uint32_t>(tile), i, j)) {
          SetBlock(candidates, i, j, 1 << level_, false);
        }
      });
    });
  }

 private:
  template <typename Visit>
  void ForEachNode(std::uint32_t tile, int i, int j, const Visit& visit) const {
    const int side = 1 << level_, step = StepOf(level_);
    for (int y = j; y <= j + side; y += step) {
      for (int x = i; x <= i + side; x += step) visit(x, y, Normalise(directory_, tile, x, y));
    }
  }

  bool IsLinear(std::uint32_t tile, int i, int j) const {
    std::size_t all_parts = 0;
    for (std::size_t k = 0; k < values_.size(); ++k) {
      for (int part = 0; part < PartsOf(values_[k].components); ++part, ++all_parts) {
        if (!IsPartLinear(tile, i, j, values_[k], part, all_parts)) return false;
      }
    }
    return true;
  }

  // Let D be the largest deviation of a node from the bilinear interpolation of the corners, and T
  // the distance of the two diagonals in the centre. Triangles between corners and middles of edges
  // deviate from the bilinear interpolation by at most T / 2 + D: T / 2 for the diagonals, D at the
  // middles. The triangles therefore deviate from a node by at most 2 D + T / 2.
  bool IsPartLinear(std::uint32_t tile, int i, int j, const AttributeValues& attribute, int part,
                    std::size_t index) const {
    const int side = 1 << level_;
    const auto at = [&](int x, int y) {
      const std::size_t node = blocks_.nodes.At(Normalise(directory_, tile, x, y));
      return PartOf(&attribute.values[node * attribute.components], attribute.components, part);
    };
    const CornerInterpolation corners(at(i, j), at(i + side, j), at(i, j + side),
                                      at(i + side, j + side), i, j, side);
    const double tolerance = blocks_.tolerances[index];
    const double apart = corners.DistanceOfDiagonals() / 2;
    if (!(apart <= tolerance)) return false;
    const double most = (tolerance - apart) / 2;
    bool is_linear = true;
    ForEachNode(tile, i, j, [&](int x, int y, const TilePlace&) {
      is_linear = is_linear && std::abs(at(x, y) - corners.At(x, y)) <= most;
    });
    return is_linear &&
           (level_ < kLevelOfWindows || AreWindowsLinear(tile, i, j, corners, index, most));
  }

  bool AreWindowsLinear(std::uint32_t tile, int i, int j, const CornerInterpolation& corners,
                        std::size_t index, double most) const {
    const std::size_t stride = kWindowMoments + parts_;
    const int along = 1 << (level_ - kWindowShift);
    for (int row = 0; row < along; ++row) {
      for (int column = 0; column < along; ++column) {
        const std::size_t window = blocks_.window_of[tile] +
                                   ((j >> kWindowShift) + row) * kWindowsAlong +
                                   (i >> kWindowShift) + column;
        const double* const sums = &blocks_.windows[window * stride];
        const double deviation = sums[kWindowMoments + index] - corners.SumOver(sums);
        if (!(std::abs(deviation) <= most * sums[0])) return false;
      }
    }
    return true;
  }

  const TileDirectory& directory_;
  const AttributeSource& attributes_;
  const int level_;
  Blocks& blocks_;
  std::size_t parts_ = 0;
  std::span<const AttributeValues> values_;
};

// Sums over the particles of each window of the tiles that have blocks with windows.
void SumWindows(const AttributeSource& attributes, Blocks& blocks) {
  const ParticleBins& bins = attributes.bins;
  std::size_t stride = kWindowMoments;
  for (const Attribute& attribute : attributes.frame.attributes) {
    stride += PartsOf(attribute.components);
  }
  const auto has_windows = [&](std::size_t tile) {
    return !IsEmpty(blocks.linear[tile][kLevelOfWindows]);
  };
  blocks.window_of.resize(blocks.linear.size());
  std::uint32_t next = 0;
  for (std::size_t tile = 0; tile < blocks.linear.size(); ++tile) {
    blocks.window_of[tile] = next;
    if (has_windows(tile)) next += kWindowsOfTile;
  }
  blocks.windows.assign(next * stride, 0);
  ParallelFor(blocks.linear.size(), [&](std::size_t tile) {
    if (!has_windows(tile)) return;
    double* const windows = &blocks.windows[blocks.window_of[tile] * stride];
    for (std::uint32_t k = bins.offsets[tile]; k < bins.offsets[tile + 1]; ++k) {
      const BinnedParticle& particle = bins.particles[k];
      const double x = particle.x, y = particle.y;
      const int window = (static_cast<int>(y) >> kWindowShift) * kWindowsAlong +
                         (static_cast<int>(x) >> kWindowShift);
      double* sums = windows + window * stride;
      *sums++ += 1;
      *sums++ += x;
      *sums++ += y;
      *sums++ += x * y;
      for (const Attribute& attribute : attributes.frame.attributes) {
        const float* const value =
            &attribute.values[particle.source * std::size_t(attribute.components)];
        const int parts = PartsOf(attribute.components);
        for (int part = 0; part < parts; ++part) {
          *sums++ += PartOf(value, attribute.components, part);
        }
      }
    }
  });
}

// Sets the tolerances of all parts. The tolerance of a vector is a fraction of the range of the
// component that varies most.
void FindTolerances(const AttributeSource& attributes, std::vector<double>& tolerances) {
  tolerances.clear();
  for (const Attribute& attribute : attributes.frame.attributes) {
    double range = 0, largest = 0;
    for (int c = 0; c < attribute.components; ++c) {
      double least = INFINITY, most = -INFINITY;
      for (std::size_t k = c; k < attribute.values.size(); k += attribute.components) {
        least = std::min<double>(least, attribute.values[k]);
        most = std::max<double>(most, attribute.values[k]);
      }
      range = std::max(range, most - least);
      largest = std::max({largest, std::abs(least), std::abs(most)});
    }
    // Sums are rounded, and values are floats. With this lower bound, a constant passes the test.
    constexpr double kRounding = 0x1p-22;
    const double tolerance = std::max(attributes.tolerance * range, kRounding * largest);
    tolerances.insert(tolerances.end(), PartsOf(attribute.components), tolerance);
  }
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

// The interior cells whose blocks have a smaller level than a given one.
class SmallerCells {
 public:
  SmallerCells(const TileDirectory& directory, const Blocks& blocks, int level)
      : directory_(directory), blocks_(blocks), level_(level) {}

  // Whether a cell of this set lies along one of the four edges of a block, outside of the block.
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

void FindBlocks(const TileDirectory& directory, std::span<const BitRows> interior, double cell_size,
                const AttributeSource& attributes, Blocks& blocks) {
  blocks.linear.resize(interior.size());
  blocks.at_least.assign(interior.size(), {});
  ParallelFor(interior.size(), [&](std::size_t tile) {
    FindInteriorBlocks(interior[tile], blocks.linear[tile]);
    blocks.at_least[tile][0] = interior[tile];
  });
  FindTolerances(attributes, blocks.tolerances);
  SumWindows(attributes, blocks);
  for (int level = kBlockLevels - 1; level >= 1; --level) {
    const auto for_each_row = [&](const auto& change) {
      if (level + 1 == kBlockLevels) return;
      for (Blocks::Levels& levels : blocks.linear) {
        for (int j = 0; j < kTileSize; ++j) change(levels[level][j], levels[level + 1][j]);
      }
    };
    for_each_row([](std::uint32_t& cells, std::uint32_t larger) { cells &= ~larger; });
    LevelTest(directory, attributes, level, blocks).Run(cell_size);
    for_each_row([](std::uint32_t& cells, std::uint32_t larger) { cells |= larger; });
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
