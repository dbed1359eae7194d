#include "space/bins.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
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
  return static_cast<std::int64_t>(std::floor(cells * (1 << kFractionBits) + .5));
}

/// A position in its brick as a number: first the cell, then the fractions, so that keys sort by
/// cell.
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

float Coordinate(std::uint64_t key, int axis) {
  const std::uint64_t cell = key >> (kFractionsOfKey + axis * kBrickShift) & 7;
  const std::uint64_t fraction = key >> (axis * kFractionBits) & 0x1ffff;
  return static_cast<float>(cell << kFractionBits | fraction) * (1.0f / (1 << kFractionBits));
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
                       SpaceBins& bins) {
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
      if (!(std::abs(cells) < kMostCells)) return TooFar(p, axis, value, scale);
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

/// Adds the bricks within `reach` of the box around the particles of each brick. Returns false if
/// there are more than `most`.
bool AddReachedBricks(double reach, std::size_t most, SpaceBins& bins) {
  const std::size_t homes = bins.bricks.size();
  bins.homes.assign(bins.bricks.bricks().begin(), bins.bricks.bricks().end());
  std::vector<SpaceBins::Box>& boxes = bins.boxes;
  boxes.assign(homes, {});
  for (std::size_t p = 0; p < bins.keys.size(); ++p) {
    SpaceBins::Box& box = boxes[bins.home[p]];
    for (int axis = 0; axis < 3; ++axis) {
      const float value = Coordinate(bins.keys[p], axis);
      box.low[axis] = std::min(box.low[axis], value);
      box.high[axis] = std::max(box.high[axis], value);
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

/// Compares the attributes of two particles at one position, so that sums over their values do not
/// depend on the order of the frame.
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

/// Sorts the particles of a brick, [first, last) of `sorted`, and finds the first particle of each
/// cell.
void SortBrick(const Frame& frame, std::size_t first, std::size_t last, SpaceBins& bins,
               std::uint32_t brick) {
  const auto before = [&](const SpaceBins::Keyed& a, const SpaceBins::Keyed& b) {
    if (a.key != b.key) return a.key < b.key;
    if (!frame.volumes.empty() && frame.volumes[a.source] != frame.volumes[b.source]) {
      return frame.volumes[a.source] < frame.volumes[b.source];
    }
    return !frame.attributes.empty() && HasLessAttributes(frame, a.source, b.source);
  };
  std::sort(bins.sorted.begin() + first, bins.sorted.begin() + last, before);
  std::size_t p = first;
  for (int cell = 0; cell < kBrickNodes; ++cell) {
    bins.cells[brick][cell] = static_cast<std::uint32_t>(p);
    while (p < last && bins.sorted[p].key >> kFractionsOfKey == static_cast<std::uint64_t>(cell)) {
      ++p;
    }
  }
  bins.cells[brick][kBrickNodes] = static_cast<std::uint32_t>(last);
}

}  // namespace

void SpaceBins::Clear() {
  bricks.Clear();
  cells.clear();
  x.clear();
  y.clear();
  z.clear();
  weight.clear();
  source.clear();
}

absl::Status FindBricks(const Frame& frame, const Scale& scale, const FrameLimits& limits,
                        SpaceBins& bins) {
  bins.Clear();
  absl::Status status = std::visit(
      [&](auto positions) { return FindHomes(positions, scale, limits.max_tiles, bins); },
      frame.positions);
  if (!status.ok()) return status;
  // Inside nodes are within the kernel radius of a particle, and the other corners of their cells
  // at most one cell farther. 1/64 of a cell is for the rounding of positions.
  constexpr double kMargin = 1 + 1.0 / 64;
  if (!AddReachedBricks(scale.kernel_radius + kMargin, limits.max_tiles, bins)) {
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
    bins.sorted[next[bins.home[p]]++] = {bins.keys[p], static_cast<std::uint32_t>(p)};
  }
  bins.cells.resize(bricks);
  bins.x.resize(count + kBinPadding);
  bins.y.resize(count + kBinPadding);
  bins.z.resize(count + kBinPadding);
  bins.source.resize(count);
  bins.weight.resize(frame.volumes.empty() ? 0 : count + kBinPadding);
  const double weight_per_world_volume =
      scale.weight_per_volume / scale.cell_size / scale.cell_size / scale.cell_size;
  ParallelFor(static_cast<std::uint32_t>(bricks), [&](std::uint32_t brick) {
    // `next` is now the end of each brick.
    const std::size_t first = brick == 0 ? 0 : next[brick - 1], last = next[brick];
    SortBrick(frame, first, last, bins, brick);
    for (std::size_t p = first; p < last; ++p) {
      const SpaceBins::Keyed& particle = bins.sorted[p];
      bins.x[p] = Coordinate(particle.key, 0);
      bins.y[p] = Coordinate(particle.key, 1);
      bins.z[p] = Coordinate(particle.key, 2);
      bins.source[p] = particle.source;
      if (bins.weight.empty()) continue;
      bins.weight[p] = static_cast<float>(frame.volumes[particle.source] * weight_per_world_volume);
    }
  });
}

}  // namespace partiemc::space
