#include "filter/noise_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <variant>

#include "base/bits.h"
#include "base/cancellation.h"
#include "base/parallel.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kNew = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kGrain = 1 << 12;

// Finds the filtered coordinates in the positions of a frame.
class Coordinates {
 public:
  explicit Coordinates(const NoiseFilterInput& input)
      : axes_(input.axes), components_(static_cast<std::size_t>(input.frame.components)) {}

  std::size_t AxisCount() const { return axes_.size(); }

  // The index of a coordinate in the positions of the frame.
  std::size_t PlaceOf(std::size_t particle, std::size_t axis) const {
    return particle * components_ + static_cast<std::size_t>(axes_[axis]);
  }

 private:
  std::span<const int> axes_;
  std::size_t components_;
};

// Makes a vector of the values at(axis); other components are 0.
template <typename At>
Vec3 VectorOf(std::size_t axes, const At& at) {
  return {at(std::size_t{0}), at(std::size_t{1}), axes == 3 ? at(std::size_t{2}) : 0.0};
}

// Resizes without the surplus of growth by doubling.
template <typename Value>
void ResizeExactly(std::size_t count, std::vector<Value>& values) {
  values.reserve(count);
  values.resize(count);
}

// Sorts the particles by id, which gives their ranks: a radix sort by the digits in which ids
// differ.
void SortById(const Frame& frame, NoiseFilterScratch& s) {
  constexpr int kDigit = 11;
  constexpr std::uint64_t kMask = (1u << kDigit) - 1;
  const std::span<const std::uint64_t> ids = frame.ids;
  ResizeExactly(ids.size(), s.particles);
  ResizeExactly(ids.size(), s.last);  // The other buffer of the sort.
  std::iota(s.particles.begin(), s.particles.end(), std::uint32_t{0});
  if (std::ranges::is_sorted(ids)) return;
  std::uint64_t different = 0;
  for (const std::uint64_t id : ids) different |= id ^ ids[0];
  for (int shift = 0; shift < 64; shift += kDigit) {
    if ((different >> shift & kMask) == 0) continue;
    ThrowIfCancelled();
    std::array<std::uint32_t, kMask + 2> first{};  // By digit: its first place.
    for (const std::uint64_t id : ids) ++first[(id >> shift & kMask) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const std::uint32_t particle : s.particles) {
      s.last[first[ids[particle] >> shift & kMask]++] = particle;
    }
    std::swap(s.particles, s.last);
  }
}

// Sets `last` to the index of each particle in the last history, or kNew.
void FindLast(const Frame& frame, const NoiseHistory& previous, NoiseFilterScratch& s) {
  const std::span<const std::uint64_t> ids = previous.ids;
  ParallelForRanges(s.last.size(), kGrain, [&](std::size_t first, std::size_t last) {
    auto found = std::ranges::lower_bound(ids, frame.ids[s.particles[first]]);
    for (std::size_t rank = first; rank < last; ++rank) {
      const std::uint64_t id = frame.ids[s.particles[rank]];
      while (found != ids.end() && *found < id) ++found;
      const bool is_known = found != ids.end() && *found == id;
      s.last[rank] = is_known ? static_cast<std::uint32_t>(found - ids.begin()) : kNew;
    }
  });
}

// The displacement since the last frame in spacings, relative to the motion of the box, to the
// nearest image.
Vec3 DisplacementOf(const NoiseFilterInput& input, const MotionGrid& grid,
                    const NoiseFilterScratch& s, std::size_t rank) {
  const std::size_t axes = input.axes.size();
  return VectorOf(axes, [&](std::size_t axis) {
    double last = input.previous.given[s.last[rank] * axes + axis];
    if (input.motion.any) last = input.motion.At(static_cast<std::size_t>(input.axes[axis]), last);
    const double moved = (s.next.given[rank * axes + axis] - last) / input.spacing;
    const double length = grid.length[axis];
    return length > 0 ? moved - length * Floor(moved / length + .5) : moved;
  });
}

// The given position in spacings.
Vec3 PositionOf(const NoiseFilterInput& input, const NoiseFilterScratch& s, std::size_t rank) {
  const std::size_t axes = input.axes.size();
  return VectorOf(
      axes, [&](std::size_t axis) { return s.next.given[rank * axes + axis] / input.spacing; });
}

// Starts the next history with the given positions.
template <typename Real>
void StartHistory(const NoiseFilterInput& input, std::span<const Real> positions,
                  const Coordinates& at, NoiseFilterScratch& s) {
  const Frame& frame = input.frame;
  const std::size_t axes = at.AxisCount(), count = s.particles.size();
  s.next.box = count > 0 ? input.box_to_store : std::nullopt;
  ResizeExactly(count, s.next.ids);
  ResizeExactly(count * axes, s.next.given);
  s.next.offsets.reserve(count * axes);
  s.next.offsets.assign(count * axes, 0);
  ParallelForRanges(count, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t rank = first; rank < last; ++rank) {
      s.next.ids[rank] = frame.ids[s.particles[rank]];
      for (std::size_t axis = 0; axis < axes; ++axis) {
        s.next.given[rank * axes + axis] =
            static_cast<double>(positions[at.PlaceOf(s.particles[rank], axis)]);
      }
    }
  });
}

// Finds the particles that both frames have, and their cells. Particles that moved too far become
// new. Returns the number of occupied cells.
std::size_t FindCells(const NoiseFilterInput& input, const MotionGrid& grid,
                      NoiseFilterScratch& s) {
  const std::size_t count = s.particles.size();
  ParallelForRanges(count, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t rank = first; rank < last; ++rank) {
      if (s.last[rank] == kNew) continue;
      const Vec3 moved = DisplacementOf(input, grid, s, rank);
      if (!(Dot(moved, moved) <= kMostDisplacement * kMostDisplacement)) s.last[rank] = kNew;
    }
  });
  s.known.clear();
  s.known.reserve(count);
  for (std::uint32_t rank = 0; rank < count; ++rank) {
    if (s.last[rank] != kNew) s.known.push_back(rank);
  }
  ResizeExactly(s.known.size(), s.cell_of);
  ParallelForRanges(s.known.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      Vec3 unused;
      s.cell_of[k] = CellOf(grid, PositionOf(input, s, s.known[k]), unused);
    }
  });
  return s.groups.Find(s.cell_of);
}

// Lists the particles that both frames have, once each, by their cells in this frame: sets
// `groups`, `movers` and `cells`.
void SortByCell(const NoiseFilterInput& input, const MotionGrid& grid, NoiseFilterScratch& s) {
  s.groups.Sort(s.cell_of);
  const std::span<const std::uint32_t> items = s.groups.items();
  ResizeExactly(items.size(), s.movers);
  ParallelForRanges(items.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const std::uint32_t rank = s.known[items[k]];
      CellOf(grid, PositionOf(input, s, rank), s.movers[k].at);
      s.movers[k].moved = DisplacementOf(input, grid, s, rank);
    }
  });
  s.cells.clear();
  s.cells.reserve(s.groups.groups().size());
  for (const CellGroups::Group& group : s.groups.groups()) {
    s.cells.push_back({.at = group.cell, .first = group.first, .last = group.last});
  }
}

// Sets the offsets of the particles that both frames have. In spacings, from the given position:
// the old filtered position is at `offset - moved`, the local motion predicts `offset - moved +
// motion`.
void SetOffsets(const NoiseFilterInput& input, const MotionGrid& grid, NoiseFilterScratch& s) {
  const std::size_t axes = input.axes.size();
  const double cell = input.cell_size / input.spacing;
  const NoiseHistory& previous = input.previous;
  ParallelFor(s.cells.size(), [&](std::size_t k) {
    const LocalMotion motion = FitMotion(grid, s.cells, k);
    for (std::uint32_t i = s.cells[k].first; i < s.cells[k].last; ++i) {
      const std::uint32_t rank = s.known[s.groups.items()[i]];
      const Vec3 offset = VectorOf(axes, [&](std::size_t axis) {
        return cell * static_cast<double>(previous.offsets[s.last[rank] * axes + axis]);
      });
      const Vec3 predicted = offset + (motion.At(s.movers[i].at) - s.movers[i].moved);
      if (!(Dot(predicted, predicted) <= kMostSurprise * kMostSurprise)) continue;
      const Vec3 kept = ((1 - input.weight) / cell) * predicted;
      const std::array<double, 3> values{kept.x, kept.y, kept.z};
      for (std::size_t axis = 0; axis < axes; ++axis) {
        s.next.offsets[rank * axes + axis] = static_cast<float>(values[axis]);
      }
    }
  });
}

template <typename Real>
void WritePositions(std::span<const Real> given, double cell_size, const Coordinates& at,
                    NoiseFilterScratch& s) {
  const std::size_t axes = at.AxisCount();
  s.positions.assign(given.begin(), given.end());
  ParallelForRanges(s.particles.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t rank = first; rank < last; ++rank) {
      for (std::size_t axis = 0; axis < axes; ++axis) {
        s.positions[at.PlaceOf(s.particles[rank], axis)] +=
            cell_size * static_cast<double>(s.next.offsets[rank * axes + axis]);
      }
    }
  });
}

}  // namespace

absl::Status FilterNoise(const NoiseFilterInput& input, NoiseFilterScratch& s, Frame& filtered) {
  filtered = input.frame;
  // The last history keeps its buffers, which may be larger.
  const std::uint64_t bytes =
      kBytesPerFilteredParticle * std::max(input.frame.ParticleCount(), input.previous.ids.size());
  absl::Status status = input.reserve(bytes);
  if (!status.ok()) return status;
  const Coordinates at(input);
  const MotionGrid grid = MakeMotionGrid(input.axes, input.box, input.spacing);
  SortById(input.frame, s);
  FindLast(input.frame, input.previous, s);
  std::visit([&](auto positions) { StartHistory(input, positions, at, s); }, input.frame.positions);
  const std::size_t cells = FindCells(input, grid, s);
  status = input.reserve(bytes + kBytesPerMotionCell * cells);
  if (!status.ok()) return status;
  SortByCell(input, grid, s);
  SumMoments(s.movers, s.cells);
  SetOffsets(input, grid, s);
  std::visit([&](auto positions) { WritePositions(positions, input.cell_size, at, s); },
             input.frame.positions);
  filtered.positions = std::span<const double>(s.positions);
  return absl::OkStatus();
}

}  // namespace partiemc
