#include "periodic/lift.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/bits.h"
#include "base/cancellation.h"
#include "base/parallel.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"
#include "periodic/frame_box.h"

namespace partiemc {
namespace {

// Two cells with more pairs of particles than this are joined if their bounding boxes are within
// the range.
constexpr std::uint64_t kMostPairs = 1 << 12;

// Limit of grid coordinates on axes that are not periodic. Farther particles share the outermost
// cells; their frame needs too many tiles anyway.
constexpr double kMostCells = 1 << 30;

// Particles farther from the box than this number of its lengths are refused: the rounding of their
// coordinates would be visible.
constexpr double kMostLengths = 1e6;

constexpr std::size_t kGrain = 1 << 12;

std::uint8_t AxisBit(std::size_t axis) { return static_cast<std::uint8_t>(1u << axis); }

// The grid of cells. The diagonal of a cell is at most the range (LiftInput::range), so the
// particles of a cell are in one cluster.
struct Grid {
  std::array<bool, 3> counts{};         // The coordinate counts.
  std::array<double, 3> origin{};       // Lower end of the box; 0 without a period.
  std::array<double, 3> length{};       // Period; 0: none.
  std::array<double, 3> side{1, 1, 1};  // Length of a cell.
  std::array<std::int32_t, 3> cells{};  // Along a period.
  std::array<std::int32_t, 3> reach{};  // Cells within the range.
  double range_square = 0;
};

Grid MakeGrid(const LiftInput& input) {
  Grid grid;
  grid.range_square = input.range * input.range;
  const double longest = input.range / std::sqrt(static_cast<double>(input.axes.size()));
  for (const int axis : input.axes) {
    const auto k = static_cast<std::size_t>(axis);
    grid.counts[k] = true;
    grid.side[k] = longest;
    if (const auto& periodic = input.box.axes[k]) {
      grid.origin[k] = periodic->origin;
      grid.length[k] = periodic->length;
      grid.cells[k] = static_cast<std::int32_t>(std::ceil(periodic->length / longest));
      grid.side[k] = periodic->length / grid.cells[k];
    }
    grid.reach[k] = static_cast<std::int32_t>(std::ceil(input.range / grid.side[k]));
  }
  return grid;
}

// The image of the box in which a coordinate lies.
double ImageOf(const Grid& grid, std::size_t axis, double coordinate) {
  return grid.length[axis] > 0 ? Floor((coordinate - grid.origin[axis]) / grid.length[axis]) : 0;
}

// Reads the coordinates of particles. The other coordinates are 0.
template <typename Real>
std::array<double, 3> CoordinatesOf(const Grid& grid, std::span<const Real> positions,
                                    std::size_t components, std::size_t particle) {
  std::array<double, 3> at{};
  for (std::size_t k = 0; k < components; ++k) {
    if (grid.counts[k]) at[k] = static_cast<double>(positions[particle * components + k]);
  }
  return at;
}

std::array<double, 3> Wrapped(const Grid& grid, std::array<double, 3> at) {
  for (std::size_t k = 0; k < 3; ++k) at[k] -= ImageOf(grid, k, at[k]) * grid.length[k];
  return at;
}

GridCell CellOf(const Grid& grid, const std::array<double, 3>& wrapped) {
  GridCell cell{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!grid.counts[k]) continue;
    const double at = (wrapped[k] - grid.origin[k]) / grid.side[k];
    // Rounding may put a wrapped coordinate onto the upper face of the box, or below the box.
    cell[k] = grid.length[k] > 0
                  ? std::clamp(static_cast<std::int32_t>(at), 0, grid.cells[k] - 1)
                  : static_cast<std::int32_t>(Floor(std::clamp(at, -kMostCells, kMostCells)));
  }
  return cell;
}

// Finds the cell of each particle, and returns the number of occupied cells.
template <typename Real>
std::size_t FindCells(const Grid& grid, std::span<const Real> positions, std::size_t components,
                      LiftScratch& s) {
  const std::size_t count = positions.size() / components;
  s.cell_of.reserve(count);
  s.cell_of.resize(count);
  ParallelForRanges(count, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      s.cell_of[k] = CellOf(grid, Wrapped(grid, CoordinatesOf(grid, positions, components, k)));
    }
  });
  return s.groups.Find(s.cell_of);
}

template <typename Real>
void WrapParticles(const Grid& grid, std::span<const Real> positions, std::size_t components,
                   LiftScratch& s) {
  const std::span<const std::uint32_t> particles = s.groups.items();
  s.wrapped.reserve(particles.size());
  s.wrapped.resize(particles.size());
  ParallelForRanges(particles.size(), kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const auto at = Wrapped(grid, CoordinatesOf(grid, positions, components, particles[k]));
      s.wrapped[k] = {at[0], at[1], at[2]};
    }
  });
}

void ListCells(LiftScratch& s) {
  s.cells.clear();
  s.cells.reserve(s.groups.groups().size());
  for (const CellGroups::Group& group : s.groups.groups()) {
    Vec3 low = s.wrapped[group.first], high = low;
    for (std::uint32_t k = group.first + 1; k < group.last; ++k) {
      low = Lower(low, s.wrapped[k]);
      high = Upper(high, s.wrapped[k]);
    }
    s.cells.push_back(
        {.at = group.cell, .first = group.first, .last = group.last, .low = low, .high = high});
  }
}

Vec3 ShiftOf(const Grid& grid, const Image& image) {
  return {static_cast<double>(image[0]) * grid.length[0],
          static_cast<double>(image[1]) * grid.length[1],
          static_cast<double>(image[2]) * grid.length[2]};
}

// Whether two cells have particles within the range, if `b` is moved by `shift`.
bool AreNear(const Grid& grid, const LiftScratch& s, const LiftCell& a, const LiftCell& b,
             const Vec3& shift) {
  const Vec3 low = b.low + shift, high = b.high + shift;
  const Vec3 gap = Upper(Upper(a.low - high, low - a.high), Vec3{});
  if (Dot(gap, gap) > grid.range_square) return false;
  const Vec3 span = Upper(a.high, high) - Lower(a.low, low);
  if (Dot(span, span) <= grid.range_square) return true;
  if (std::uint64_t{a.last - a.first} * (b.last - b.first) > kMostPairs) return true;
  for (std::uint32_t i = a.first; i < a.last; ++i) {
    for (std::uint32_t j = b.first; j < b.last; ++j) {
      const Vec3 apart = s.wrapped[j] + shift - s.wrapped[i];
      if (Dot(apart, apart) <= grid.range_square) return true;
    }
  }
  return false;
}

// Joins cells into clusters. Two cells are joined if a particle of one is at most the range
// (LiftInput::range) away from a particle of the other, or from its image (AreNear). Marks the
// clusters that percolate. Returns the axes along which any cluster percolates.
std::array<bool, 3> JoinCells(const Grid& grid, LiftScratch& s) {
  s.sets.Reset(s.cells.size());
  const auto visit = [&](std::uint32_t a, const GridCell& step) {
    GridCell at{};
    Image image{};
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = s.cells[a].at[k] + step[k];
      if (grid.cells[k] == 0) continue;
      image[k] = at[k] < 0 ? -1 : at[k] >= grid.cells[k] ? 1 : 0;
      at[k] -= static_cast<std::int32_t>(image[k]) * grid.cells[k];
    }
    const std::uint32_t b = s.groups.GroupOf(at);
    if (b == CellGroups::kNone) return;
    const ImageSets::Found from = s.sets.Find(a), to = s.sets.Find(b);
    const Image beyond = to.image - from.image;
    if (from.root == to.root && beyond == image) return;
    if (!AreNear(grid, s, s.cells[a], s.cells[b], ShiftOf(grid, image))) return;
    if (from.root != to.root) {
      s.sets.Join(from, to, image);
      return;
    }
    // The cluster reaches its own image.
    for (std::size_t k = 0; k < 3; ++k) {
      if (beyond[k] != image[k]) s.cells[a].percolates |= AxisBit(k);
    }
  };
  const auto [most_x, most_y, most_z] = grid.reach;
  for (std::uint32_t cell = 0; cell < s.cells.size(); ++cell) {
    if (cell % kGrain == 0) ThrowIfCancelled();
    // Half of the neighbours; the other half visit this cell.
    for (std::int32_t x = 0; x <= most_x; ++x) {
      for (std::int32_t y = x == 0 ? 0 : -most_y; y <= most_y; ++y) {
        for (std::int32_t z = x == 0 && y == 0 ? 1 : -most_z; z <= most_z; ++z) {
          visit(cell, {x, y, z});
        }
      }
    }
  }
  std::uint8_t all = 0;
  for (std::uint32_t cell = 0; cell < s.cells.size(); ++cell) {
    const std::uint8_t axes = s.cells[cell].percolates;
    s.cells[s.sets.Find(cell).root].percolates |= axes;
    all |= axes;
  }
  // In space, clusters may percolate along different axes.
  for (LiftCell& cell : s.cells) cell.percolates = cell.percolates == 0 ? 0 : all;
  return {(all & AxisBit(0)) != 0, (all & AxisBit(1)) != 0, (all & AxisBit(2)) != 0};
}

// Makes a cluster of each cell that percolates along all periodic axes. Returns these axes.
std::array<bool, 3> WrapCells(const Grid& grid, LiftScratch& s) {
  std::array<bool, 3> axes{};
  std::uint8_t bits = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    axes[k] = grid.length[k] > 0;
    if (axes[k]) bits |= AxisBit(k);
  }
  s.sets.Reset(s.cells.size());
  for (LiftCell& cell : s.cells) cell.percolates = bits;
  return axes;
}

// Finds the bounding box of each cluster, and the image of each cell that moves the centre of this
// box into the periodic box. Along axes along which the cluster percolates, cells stay in the box.
void ChooseImages(const Grid& grid, LiftScratch& s) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  s.low.assign(s.cells.size(), {kFar, kFar, kFar});
  s.high.assign(s.cells.size(), {-kFar, -kFar, -kFar});
  for (std::uint32_t k = 0; k < s.cells.size(); ++k) {
    const auto [root, image] = s.sets.Find(k);
    const Vec3 shift = ShiftOf(grid, image);
    s.low[root] = Lower(s.low[root], s.cells[k].low + shift);
    s.high[root] = Upper(s.high[root], s.cells[k].high + shift);
  }
  for (std::uint32_t k = 0; k < s.cells.size(); ++k) {
    const auto [root, image] = s.sets.Find(k);
    const Vec3 centre = .5 * (s.low[root] + s.high[root]);
    const Image of_centre{static_cast<std::int64_t>(ImageOf(grid, 0, centre.x)),
                          static_cast<std::int64_t>(ImageOf(grid, 1, centre.y)),
                          static_cast<std::int64_t>(ImageOf(grid, 2, centre.z))};
    s.cells[k].image = image - of_centre;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((s.cells[root].percolates & AxisBit(axis)) != 0) s.cells[k].image[axis] = 0;
    }
  }
}

template <typename Real>
void WritePositions(const Grid& grid, std::span<const Real> given, std::size_t components,
                    LiftScratch& s) {
  s.positions.resize(given.size());
  ParallelFor(s.cells.size(), [&](std::size_t k) {
    const LiftCell& cell = s.cells[k];
    for (std::uint32_t i = cell.first; i < cell.last; ++i) {
      const std::size_t first = s.groups.items()[i] * components;
      for (std::size_t axis = 0; axis < components; ++axis) {
        const auto at = static_cast<double>(given[first + axis]);
        const double lengths = static_cast<double>(cell.image[axis]) - ImageOf(grid, axis, at);
        s.positions[first + axis] = lengths == 0 ? at : at + lengths * grid.length[axis];
      }
    }
  });
}

// Checks that along periodic axes no coordinate is more than kMostLengths lengths of the box from
// its origin. `names`: by particle, its number in errors; if empty, its index.
template <typename Real>
absl::Status CheckDistances(const Grid& grid, std::span<const Real> positions,
                            std::size_t components, std::span<const std::uint32_t> names) {
  for (std::size_t first = 0; first < positions.size(); first += components) {
    for (std::size_t axis = 0; axis < components; ++axis) {
      const auto at = static_cast<double>(positions[first + axis]);
      if (std::abs(at - grid.origin[axis]) <= kMostLengths * grid.length[axis]) continue;
      if (grid.length[axis] == 0) continue;
      const std::size_t particle = first / components;
      const std::size_t name = names.empty() ? particle : names[particle];
      return InvalidFrame(kReasonOutOfRange,
                          CoordinateField("positions", name, static_cast<int>(axis)),
                          ShortestNumber(at), "must be at most 1e6 lengths away from the box");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckAxes(const LiftInput& input) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (!input.box.axes[k] || std::ranges::count(input.axes, static_cast<int>(k)) > 0) continue;
    return InvalidParameter(absl::StrCat("box.", kAxisNames[k]), "present",
                            "must be absent: it is no axis of the plane of the particles");
  }
  return absl::OkStatus();
}

absl::Status Percolates(const std::array<bool, 3>& axes) {
  std::string names;
  for (std::size_t k = 0; k < 3; ++k) {
    if (axes[k]) absl::StrAppend(&names, names.empty() ? "" : " and ", kAxisNames[k]);
  }
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonPercolates), "positions", absl::StrCat("a body percolates along ", names),
       "must end more than two kernel radii before its own image; leave out this periodic axis to "
       "have the body end at the box"});
}

// Calls visit(particle, lengths) for each copy: the index of its particle, and by how many lengths
// along each axis the copy lies beyond it.
template <typename Visit>
void ForEachCopy(const Grid& grid, LiftScratch& s, std::size_t components, double margin,
                 const Visit& visit) {
  for (std::uint32_t k = 0; k < s.cells.size(); ++k) {
    const std::uint8_t axes = s.cells[s.sets.Find(k).root].percolates;
    if (axes == 0) continue;
    for (std::uint32_t i = s.cells[k].first; i < s.cells[k].last; ++i) {
      if (i % kItemsPerCheck == 0) ThrowIfCancelled();
      const std::uint32_t particle = s.groups.items()[i];
      Image least{}, most{};
      for (std::size_t axis = 0; axis < components; ++axis) {
        if ((axes & AxisBit(axis)) == 0) continue;
        const double above = s.positions[particle * components + axis] - grid.origin[axis];
        const double reach = std::min(margin, grid.length[axis]);
        most[axis] = above <= reach ? 1 : 0;
        least[axis] = grid.length[axis] - above <= reach ? -1 : 0;
      }
      for (std::int64_t x = least[0]; x <= most[0]; ++x) {
        for (std::int64_t y = least[1]; y <= most[1]; ++y) {
          for (std::int64_t z = least[2]; z <= most[2]; ++z) {
            if (x != 0 || y != 0 || z != 0) visit(particle, Image{x, y, z});
          }
        }
      }
    }
  }
}

// Sets `values` to the values of the given particles and of the copies. `given`: `components` per
// particle.
template <typename Value>
std::span<const Value> WithCopies(std::span<const Value> given, std::size_t components,
                                  std::span<const std::uint32_t> originals,
                                  std::vector<Value>& values) {
  if (given.empty()) return given;
  values.reserve(given.size() + components * originals.size());
  values.assign(given.begin(), given.end());
  for (std::size_t copy = 0; copy < originals.size(); ++copy) {
    if (copy % kItemsPerCheck == 0) ThrowIfCancelled();
    const std::uint32_t particle = originals[copy];
    const auto first = given.begin() + static_cast<std::ptrdiff_t>(particle * components);
    values.insert(values.end(), first, first + static_cast<std::ptrdiff_t>(components));
  }
  return values;
}

// Bytes of a particle with everything that a copy repeats.
std::uint64_t BytesOfCopy(const Frame& frame) {
  std::uint64_t bytes = sizeof(std::uint32_t) + sizeof(float) + sizeof(std::uint64_t) +
                        frame.components * (sizeof(double) + sizeof(float));
  for (const Attribute& attribute : frame.attributes) bytes += 4 * attribute.components;
  return bytes;
}

// Appends copies of the particles of percolating clusters. `bytes`: reserved so far.
absl::Status AddCopies(const LiftInput& input, const Grid& grid, std::uint64_t bytes,
                       LiftScratch& s, LiftedFrame& lifted) {
  const Frame& given = input.frame;
  const auto components = static_cast<std::size_t>(given.components);
  std::uint64_t copies = 0;
  ForEachCopy(grid, s, components, input.margin, [&](std::uint32_t, const Image&) { ++copies; });
  const std::uint64_t all = given.ParticleCount() + copies;
  if (all > FrameLimits::kMostParticles) {
    return InvalidFrame(kReasonTooManyParticles, "positions", absl::StrCat(all),
                        absl::StrCat("must be at most ", FrameLimits::kMostParticles,
                                     " with the copies beyond the faces of the box"));
  }
  // All arrays are copied, so the given particles count, too.
  if (absl::Status status = input.reserve(bytes + all * BytesOfCopy(given)); !status.ok()) {
    return status;
  }
  s.originals.clear();
  s.originals.reserve(copies);
  s.positions.reserve(components * all);
  ForEachCopy(grid, s, components, input.margin, [&](std::uint32_t particle, const Image& lengths) {
    for (std::size_t axis = 0; axis < components; ++axis) {
      s.positions.push_back(s.positions[particle * components + axis] +
                            static_cast<double>(lengths[axis]) * grid.length[axis]);
    }
    s.originals.push_back(particle);
  });
  lifted.originals = s.originals;
  Frame& frame = lifted.frame;
  frame.volumes = WithCopies(given.volumes, 1, s.originals, s.volumes);
  frame.ids = WithCopies(given.ids, 1, s.originals, s.ids);
  frame.velocities = WithCopies(given.velocities, components, s.originals, s.velocities);
  s.attributes.assign(given.attributes.begin(), given.attributes.end());
  s.values.resize(std::max(s.values.size(), s.attributes.size()));
  for (std::size_t k = 0; k < s.attributes.size(); ++k) {
    Attribute& attribute = s.attributes[k];
    attribute.values = WithCopies(attribute.values, static_cast<std::size_t>(attribute.components),
                                  s.originals, s.values[k]);
  }
  frame.attributes = s.attributes;
  return absl::OkStatus();
}

}  // namespace

absl::Status Lift(const LiftInput& input, LiftScratch& s, LiftedFrame& lifted) {
  lifted = {.frame = input.frame, .particles = input.frame.ParticleCount()};
  if (absl::Status status = CheckAxes(input); !status.ok()) return status;
  const Grid grid = MakeGrid(input);
  const auto components = static_cast<std::size_t>(input.frame.components);
  absl::Status checked =
      std::visit([&](auto of) { return CheckDistances(grid, of, components, input.names); },
                 input.frame.positions);
  std::uint64_t bytes = kBytesPerLiftedParticle * input.frame.ParticleCount();
  if (checked.ok()) checked = input.reserve(bytes);
  if (!checked.ok()) return checked;
  const std::size_t cells =
      std::visit([&](auto positions) { return FindCells(grid, positions, components, s); },
                 input.frame.positions);
  bytes += kBytesPerLiftCell * cells;
  checked = input.reserve(bytes);
  if (!checked.ok()) return checked;
  s.groups.Sort(s.cell_of);
  std::visit([&](auto positions) { WrapParticles(grid, positions, components, s); },
             input.frame.positions);
  ListCells(s);
  lifted.percolates = input.wraps ? WrapCells(grid, s) : JoinCells(grid, s);
  const bool has_copies = lifted.percolates != std::array<bool, 3>{};
  if (has_copies && input.margin == 0) return Percolates(lifted.percolates);
  ChooseImages(grid, s);
  std::visit([&](auto positions) { WritePositions(grid, positions, components, s); },
             input.frame.positions);
  if (has_copies) checked = AddCopies(input, grid, bytes, s, lifted);
  lifted.frame.positions = std::span<const double>(s.positions);
  return checked;
}

}  // namespace partiemc
