#include "space/bins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/bits.h"
#include "base/parallel.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc::space {
namespace {

constexpr int kFractionBits = 17;
constexpr int kBrickBits = kFractionBits + kBrickShift;
constexpr double kMostCells = 0x1p30;

/// A coordinate in units of 2^-17 cells. Requires: within kMostCells cells.
std::int64_t Quantised(double cells) {
  const double value = cells * (1 << kFractionBits) + .5;
  // std::floor is a call of the library where the instruction set has no instruction for it.
  const auto whole = static_cast<std::int64_t>(value);
  return whole - static_cast<std::int64_t>(static_cast<double>(whole) > value);
}

/// A position in its brick as a number that sorts by cell: first the cell, then the fractions.
std::uint64_t KeyOf(const std::array<std::int64_t, 3>& at) {
  std::uint64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) {
    key = key << kBrickShift | (static_cast<std::uint64_t>(at[axis]) >> kFractionBits & 7);
  }
  for (int axis = 2; axis >= 0; --axis) {
    key = key << kFractionBits | (static_cast<std::uint64_t>(at[axis]) & 0x1ffff);
  }
  return key;
}

constexpr int kFractionsOfKey = 3 * kFractionBits;
constexpr int kCellBits = 3 * kBrickShift;
constexpr int kClassShift = kFractionsOfKey + kCellBits;
static_assert(kMostClasses <= 1 << (64 - kClassShift), "a key has room for the class");

float Coordinate(std::uint64_t key, int axis) {
  const std::uint64_t cell = key >> (kFractionsOfKey + axis * kBrickShift) & 7;
  const std::uint64_t fraction = key >> (axis * kFractionBits) & 0x1ffff;
  return static_cast<float>(cell << kFractionBits | fraction) * (1.0f / (1 << kFractionBits));
}

/// The key by which particles are sorted: the class, the cell of the class, the place in this cell.
std::uint64_t SortKey(std::uint64_t key, std::uint32_t of_class, int shift) {
  constexpr std::uint64_t kInBrick = kBrickSize - 1;
  const std::uint64_t within = (std::uint64_t{1} << shift) - 1;
  std::uint64_t cell = of_class, rest = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const std::uint64_t at = key >> (kFractionsOfKey + axis * kBrickShift) & kInBrick;
    cell = cell << (kBrickShift - shift) | at >> shift;
    rest = rest << shift | (at & within);
  }
  constexpr std::uint64_t kFractions = (std::uint64_t{1} << kFractionsOfKey) - 1;
  return (cell << 3 * shift | rest) << kFractionsOfKey | (key & kFractions);
}

absl::Status TooFar(std::size_t particle, int axis, double value, const Scale& scale) {
  return InvalidFrame(kReasonOutOfRange, CoordinateField("positions", particle, axis),
                      ShortestNumber(value),
                      absl::StrCat("must be within 2^30 cells of ", ShortestNumber(scale.cell_size),
                                   " from the origin"));
}

absl::Status TooManyBricks(const Scale& scale, std::size_t most) {
  return ViolationError(absl::StatusCode::kResourceExhausted,
                        {std::string(kReasonTooManyTiles), "positions",
                         absl::StrCat("more than ", most, " bricks of 8 x 8 x 8 cells"),
                         absl::StrCat("must reach at most ", most, " bricks: is the spacing of ",
                                      ShortestNumber(scale.spacing * scale.cell_size), " right?")});
}

/// Finds the brick and the key of each particle.
template <typename Real>
absl::Status FindHomes(std::span<const Real> positions, const Scale& scale, std::size_t most_bricks,
                       const GivenParticles& given, SpaceBins& bins) {
  const double cells_per_world = 1 / scale.cell_size;
  const std::size_t count = positions.size() / 3;
  bins.home.resize(count);
  bins.keys.resize(count);
  BrickCoordinate recent;
  std::uint32_t recent_index = kNoIndex;
  for (std::size_t p = 0; p < count; ++p) {
    std::array<std::int64_t, 3> at;
    for (int axis = 0; axis < 3; ++axis) {
      const auto value = static_cast<double>(positions[3 * p + axis]);
      const double cells = value * cells_per_world;
      if (!(std::abs(cells) < kMostCells)) return TooFar(given.Of(p), axis, value, scale);
      at[axis] = Quantised(cells);
    }
    const BrickCoordinate brick{static_cast<std::int32_t>(at[2] >> kBrickBits),
                                static_cast<std::int32_t>(at[1] >> kBrickBits),
                                static_cast<std::int32_t>(at[0] >> kBrickBits)};
    if (recent_index == kNoIndex || brick != recent) {
      recent = brick;
      recent_index = bins.bricks.Insert(brick);
      if (bins.bricks.size() > most_bricks) return TooManyBricks(scale, most_bricks);
    }
    bins.home[p] = recent_index;
    bins.keys[p] = KeyOf(at);
  }
  return absl::OkStatus();
}

/// Finds the sizes and the size classes of the particles. Adds the class to each key.
void FindClasses(const Frame& frame, const Scale& scale, SpaceBins& bins) {
  const double world = scale.spacing * scale.cell_size;
  std::vector<float>& size = bins.given_size;
  size.resize(frame.volumes.size());
  float largest = 0;
  for (std::size_t p = 0; p < size.size(); ++p) {
    size[p] = static_cast<float>(CubeRoot(double{frame.volumes[p]}) / world);
    largest = std::max(largest, size[p]);
  }
  std::array<SizeClass, kMostClasses> classes;
  for (SizeClass& of : classes) of.most = 0;
  for (std::size_t p = 0; p < size.size(); ++p) {
    std::uint64_t index = 0;
    for (float limit = largest / kClassRatio; size[p] <= limit && index + 1 < kMostClasses;
         limit /= kClassRatio) {
      ++index;
    }
    bins.keys[p] |= index << kClassShift;
    classes[index].most = std::max(classes[index].most, size[p]);
  }
  // Only classes with particles stay.
  std::array<std::uint64_t, kMostClasses> place{};
  bins.classes.clear();
  for (int k = 0; k < kMostClasses; ++k) {
    if (classes[k].most == 0) continue;
    place[k] = bins.classes.size();
    // Cells are about as wide as the largest particle of the class: 2^shift, while the particle is
    // wider than 2^(shift - 1/2).
    const double width = double{classes[k].most} * scale.spacing;
    int& shift = classes[k].shift;
    for (shift = 0; shift < kBrickShift && width * width >= PowerOfTwo(2 * shift + 1);) ++shift;
    bins.classes.push_back(classes[k]);
  }
  constexpr std::uint64_t kPosition = (std::uint64_t{1} << kClassShift) - 1;
  for (std::uint64_t& key : bins.keys) {
    key = (key & kPosition) | place[key >> kClassShift] << kClassShift;
  }
}

/// Adds the bricks within `reach` of the box around the particles of each brick. With own sizes,
/// particles reach farther by (size - 1) kernel radii. Returns false if there are more than `most`.
bool AddReachedBricks(double reach, float kernel_radius, std::size_t most, SpaceBins& bins) {
  const std::size_t homes = bins.bricks.size();
  bins.homes.assign(bins.bricks.bricks().begin(), bins.bricks.bricks().end());
  std::vector<SpaceBins::Box>& boxes = bins.boxes;
  boxes.assign(homes, {});
  for (std::size_t p = 0; p < bins.keys.size(); ++p) {
    SpaceBins::Box& box = boxes[bins.home[p]];
    const float farther = bins.given_size.empty() ? 0 : kernel_radius * (bins.given_size[p] - 1);
    for (int axis = 0; axis < 3; ++axis) {
      const float value = Coordinate(bins.keys[p], axis);
      box.low[axis] = std::min(box.low[axis], value - farther);
      box.high[axis] = std::max(box.high[axis], value + farther);
    }
  }
  for (std::size_t home = 0; home < homes; ++home) {
    std::array<int, 3> low, high;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = static_cast<int>(std::floor((boxes[home].low[axis] - reach) / kBrickSize));
      high[axis] = static_cast<int>(std::floor((boxes[home].high[axis] + reach) / kBrickSize));
    }
    const BrickCoordinate at = bins.homes[home];
    for (int dz = low[2]; dz <= high[2]; ++dz) {
      for (int dy = low[1]; dy <= high[1]; ++dy) {
        for (int dx = low[0]; dx <= high[0]; ++dx) {
          bins.bricks.Insert({at.z + dz, at.y + dy, at.x + dx});
        }
      }
    }
    if (bins.bricks.size() > most) return false;
  }
  return true;
}

/// Compares the attributes of two particles at one position. Their order then decides the order of
/// sums, which does not depend on the order of the frame.
bool HasLessAttributes(const Frame& frame, std::size_t a, std::size_t b) {
  for (const Attribute& attribute : frame.attributes) {
    const auto count = static_cast<std::size_t>(attribute.components);
    const auto of_a = attribute.values.subspan(a * count, count),
               of_b = attribute.values.subspan(b * count, count);
    if (std::ranges::equal(of_a, of_b)) continue;
    return std::ranges::lexicographical_compare(of_a, of_b);
  }
  return false;
}

/// The cells of all classes of a brick, one class after the other.
class BrickCells {
 public:
  explicit BrickCells(const std::vector<SizeClass>& classes) : classes_(classes) {
    for (std::size_t k = 0; k < classes.size(); ++k) {
      first_[k + 1] = first_[k] + (1 << (kCellBits - 3 * classes[k].shift));
    }
  }

  /// The first cell of a class. For the number of classes: the number of all cells.
  int FirstOf(std::size_t of_class) const { return first_[of_class]; }

  /// The cell of a particle, by the key by which particles are sorted.
  int CellOf(std::uint64_t key) const {
    const std::size_t of_class = key >> kClassShift;
    const int shift = 3 * classes_[of_class].shift;
    const int mask = (1 << (kCellBits - shift)) - 1;
    return first_[of_class] + (static_cast<int>(key >> (kFractionsOfKey + shift)) & mask);
  }

 private:
  const std::vector<SizeClass>& classes_;
  std::array<int, kMostClasses + 1> first_{};
};

/// Sorts the particles of a brick, [first, last) of `sorted`, and finds the first particle of each
/// cell. Counts the particles of each cell, moves them there, and sorts each cell.
void SortBrick(const Frame& frame, std::size_t first, std::size_t last, SpaceBins& bins,
               std::uint32_t brick) {
  const auto before = [&](const SpaceBins::Keyed& a, const SpaceBins::Keyed& b) {
    if (a.key != b.key) return a.key < b.key;
    if (!frame.volumes.empty() && frame.volumes[a.source] != frame.volumes[b.source]) {
      return frame.volumes[a.source] < frame.volumes[b.source];
    }
    return !frame.attributes.empty() && HasLessAttributes(frame, a.source, b.source);
  };
  if (first == last) {
    for (std::size_t k = 0; k < bins.classes.size(); ++k) {
      bins.cells[brick * bins.classes.size() + k].fill(static_cast<std::uint32_t>(first));
    }
    return;
  }
  const BrickCells cells(bins.classes);
  const int count = cells.FirstOf(bins.classes.size());
  std::vector<SpaceBins::Keyed>& sorted = bins.sorted;
  // By cell: its first particle that is not in its place yet, and its end.
  std::array<std::uint32_t, kMostClasses * kBrickNodes> next, end;
  std::fill_n(end.begin(), count, 0u);
  for (std::size_t p = first; p < last; ++p) ++end[cells.CellOf(sorted[p].key)];
  auto total = static_cast<std::uint32_t>(first);
  for (int cell = 0; cell < count; ++cell) {
    next[cell] = total;
    end[cell] = total += end[cell];
  }
  for (std::size_t k = 0; k < bins.classes.size(); ++k) {
    auto& of_class = bins.cells[brick * bins.classes.size() + k];
    const auto begin = next.begin() + cells.FirstOf(k), stop = next.begin() + cells.FirstOf(k + 1);
    const auto rest = std::copy(begin, stop, of_class.begin());
    std::fill(rest, of_class.end(), stop == next.begin() + count ? total : *stop);
  }
  for (int cell = 0; cell < count; ++cell) {
    while (next[cell] != end[cell]) {
      SpaceBins::Keyed& here = sorted[next[cell]];
      const int to = cells.CellOf(here.key);
      if (to == cell) {
        ++next[cell];
      } else {
        std::swap(here, sorted[next[to]++]);
      }
    }
  }
  for (int cell = 0; cell < count; ++cell) {
    const std::size_t begin = cell == 0 ? first : end[cell - 1];
    if (end[cell] - begin < 2) continue;
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(begin), sorted.begin() + end[cell],
              before);
  }
}

}  // namespace

void SpaceBins::Clear() {
  bricks.Clear();
  cells.clear();
  x.clear();
  y.clear();
  z.clear();
  weight.clear();
  size.clear();
  given_size.clear();
  classes.assign(1, {});
  source.clear();
}

absl::Status FindBricks(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                        SpaceBins& bins, const GivenParticles& given) {
  bins.Clear();
  absl::Status status = std::visit(
      [&](auto positions) { return FindHomes(positions, scale, limits.max_tiles, given, bins); },
      frame.positions);
  if (!status.ok()) return status;
  // Inside nodes are within the kernel radius of a particle. The other corners of their cells are
  // at most one cell farther along each axis. 1/64 of a cell is for the rounding of positions.
  constexpr double kMargin = 1 + 1.0 / 64;
  if (scale.has_own_sizes) FindClasses(frame, scale, bins);
  if (!AddReachedBricks(scale.kernel_radius + kMargin, static_cast<float>(scale.kernel_radius),
                        limits.max_tiles, bins)) {
    return TooManyBricks(scale, limits.max_tiles);
  }
  bins.bricks.Seal();
  return absl::OkStatus();
}

void SortParticles(const Frame& frame, const Scale& scale, SpaceBins& bins) {
  const std::size_t count = bins.keys.size();
  const std::size_t bricks = bins.bricks.size();
  std::vector<std::uint32_t>& next = bins.next;
  // Maps the bricks with particles from insertion order to sorted order.
  std::vector<std::uint32_t>& brick_of = bins.brick_of;
  brick_of.resize(bins.homes.size());
  for (std::size_t home = 0; home < brick_of.size(); ++home) {
    brick_of[home] = bins.bricks.Find(bins.homes[home]);
  }
  next.assign(bricks + 1, 0);
  for (std::uint32_t& home : bins.home) ++next[(home = brick_of[home]) + 1];
  for (std::size_t brick = 0; brick < bricks; ++brick) next[brick + 1] += next[brick];
  bins.sorted.resize(count);
  for (std::size_t p = 0; p < count; ++p) {
    const auto of_class = static_cast<std::uint32_t>(bins.keys[p] >> kClassShift);
    const int shift = bins.classes[of_class].shift;
    bins.sorted[next[bins.home[p]]++] = {
        shift == 0 ? bins.keys[p] : SortKey(bins.keys[p], of_class, shift),
        static_cast<std::uint32_t>(p)};
  }
  bins.cells.resize(bricks * bins.classes.size());
  bins.x.resize(count + kBinPadding);
  bins.y.resize(count + kBinPadding);
  bins.z.resize(count + kBinPadding);
  bins.source.resize(count);
  const bool has_own_sizes = scale.has_own_sizes;
  bins.weight.resize(frame.volumes.empty() || has_own_sizes ? 0 : count + kBinPadding);
  bins.size.resize(has_own_sizes ? count + kBinPadding : 0);
  const double weight_per_world_volume =
      scale.weight_per_volume / scale.cell_size / scale.cell_size / scale.cell_size;
  ParallelFor(static_cast<std::uint32_t>(bricks), [&](std::uint32_t brick) {
    // `next` is now the end of each brick.
    const std::size_t first = brick == 0 ? 0 : next[brick - 1], last = next[brick];
    SortBrick(frame, first, last, bins, brick);
    for (std::size_t p = first; p < last; ++p) {
      const SpaceBins::Keyed& particle = bins.sorted[p];
      // With size classes, the key by which particles are sorted has another order of its bits.
      const std::uint64_t key = has_own_sizes ? bins.keys[particle.source] : particle.key;
      bins.x[p] = Coordinate(key, 0);
      bins.y[p] = Coordinate(key, 1);
      bins.z[p] = Coordinate(key, 2);
      bins.source[p] = particle.source;
      if (has_own_sizes) bins.size[p] = bins.given_size[particle.source];
      if (bins.weight.empty()) continue;
      bins.weight[p] = static_cast<float>(frame.volumes[particle.source] * weight_per_world_volume);
    }
  });
}

}  // namespace partiemc::space
