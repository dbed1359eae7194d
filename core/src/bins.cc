#include "bins.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "absl/strings/str_cat.h"
#include "distinct_ids.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Positions are rounded to this fraction of a cell: a tile with the widest margin spans less than
// 2^7 cells, so that 24 bits of mantissa hold any position in it exactly.
constexpr int kFractionBits = 17;
constexpr double kUnitsPerCell = 1 << kFractionBits;
constexpr float kCellsPerUnit = 1.0f / (1 << kFractionBits);
constexpr int kTileUnitShift = kFractionBits + kTileShift;

// Beyond this a double no longer resolves a millionth of a cell.
constexpr double kMaxCellsFromOrigin = 1 << 30;

// The largest coordinate in world units: that many cells of the largest spacing. Squares of
// distances stay finite.
constexpr double kMaxCoordinate = 1e69;

// How far three-component positions may leave their plane, relative to their extent in it: above
// the noise of a simulator's rounding, far below anything that a third dimension would need.
constexpr double kPlanarTolerance = 1e-5;

constexpr double kPi = 3.14159265358979323846;

constexpr char kAxisNames[] = "xyz";

struct Axes {
  int first, second, normal;
};

Axes AxesOf(Plane plane) {
  switch (plane) {
    case Plane::kXy:
      return {0, 1, 2};
    case Plane::kXz:
      return {0, 2, 1};
    case Plane::kYz:
      return {1, 2, 0};
  }
  return {0, 1, 2};
}

Axes AxesOf(const Frame& frame, Plane plane) {
  return frame.components == 3 ? AxesOf(plane) : AxesOf(Plane::kXy);
}

double Coordinate(const Frame& frame, std::size_t particle, int axis) {
  const std::size_t index = particle * frame.components + axis;
  return std::visit([index](auto view) { return static_cast<double>(view[index]); },
                    frame.positions);
}

std::string CoordinateField(std::string_view array, std::size_t particle, int axis) {
  return absl::StrCat(std::string(array), "[", particle, "].", std::string(1, kAxisNames[axis]));
}

absl::Status InvalidFrame(std::string_view reason, std::string field, std::string value,
                          std::string rule) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {std::string(reason), std::move(field), std::move(value), std::move(rule)});
}

absl::Status CheckCoordinates(const Frame& frame) {
  const std::size_t values = std::visit([](auto view) { return view.size(); }, frame.positions);
  for (std::size_t k = 0; k < values; ++k) {
    const double value =
        std::visit([k](auto view) { return static_cast<double>(view[k]); }, frame.positions);
    if (!std::isfinite(value)) {
      return InvalidFrame(kReasonNotFinite,
                          CoordinateField("positions", k / frame.components,
                                          static_cast<int>(k % frame.components)),
                          ShortestNumber(value), "must be finite");
    }
    if (std::abs(value) > kMaxCoordinate) {
      return InvalidFrame(kReasonOutOfRange,
                          CoordinateField("positions", k / frame.components,
                                          static_cast<int>(k % frame.components)),
                          ShortestNumber(value), "must be at most 1e69 in magnitude");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckPlanar(const Frame& frame, Plane plane) {
  const Axes axes = AxesOf(plane);
  double low[3], high[3];
  std::fill(low, low + 3, std::numeric_limits<double>::infinity());
  std::fill(high, high + 3, -std::numeric_limits<double>::infinity());
  std::size_t farthest = 0;
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const double value = Coordinate(frame, k, axis);
      if (axis == axes.normal && value > high[axis]) farthest = k;
      low[axis] = std::min(low[axis], value);
      high[axis] = std::max(high[axis], value);
    }
  }
  const double extent =
      std::max(high[axes.first] - low[axes.first], high[axes.second] - low[axes.second]);
  const double thickness = high[axes.normal] - low[axes.normal];
  if (thickness <= kPlanarTolerance * extent) return absl::OkStatus();
  const std::string axis(1, kAxisNames[axes.normal]);
  return InvalidFrame(
      kReasonNotPlanar, CoordinateField("positions", farthest, axes.normal),
      ShortestNumber(high[axes.normal]),
      absl::StrCat("particles must lie in the ", std::string(Name(plane)), " plane, but ", axis,
                   " ranges over [", ShortestNumber(low[axes.normal]), ", ",
                   ShortestNumber(high[axes.normal]), "]"));
}

absl::Status CheckVolumes(const Frame& frame) {
  if (frame.volumes.empty()) return absl::OkStatus();
  if (frame.volumes.size() != frame.ParticleCount()) {
    return InvalidFrame(
        kReasonCount, "volumes", absl::StrCat(frame.volumes.size(), " values"),
        absl::StrCat("must be empty or one per particle (", frame.ParticleCount(), ")"));
  }
  for (std::size_t k = 0; k < frame.volumes.size(); ++k) {
    const float volume = frame.volumes[k];
    if (!(volume > 0) || !std::isfinite(volume)) {
      return InvalidFrame(std::isfinite(volume) ? kReasonOutOfRange : kReasonNotFinite,
                          absl::StrCat("volumes[", k, "]"), ShortestNumber(volume),
                          "must be positive and finite");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckIds(const Frame& frame) {
  if (frame.ids.empty()) return absl::OkStatus();
  if (frame.ids.size() != frame.ParticleCount()) {
    return InvalidFrame(
        kReasonCount, "ids", absl::StrCat(frame.ids.size(), " values"),
        absl::StrCat("must be empty or one per particle (", frame.ParticleCount(), ")"));
  }
  const auto repeated = FindRepeated(frame.ids);
  if (!repeated) return absl::OkStatus();
  return InvalidFrame(kReasonDuplicate, absl::StrCat("ids[", repeated->again, "]"),
                      absl::StrCat(frame.ids[repeated->again]),
                      absl::StrCat("must be that of one particle only, but ids[", repeated->first,
                                   "] is the same; leave ids out where particles have none"));
}

absl::Status CheckVelocities(const Frame& frame) {
  if (frame.velocities.empty()) return absl::OkStatus();
  const std::size_t components = static_cast<std::size_t>(frame.components);
  if (frame.velocities.size() != components * frame.ParticleCount()) {
    return InvalidFrame(kReasonCount, "velocities",
                        absl::StrCat(frame.velocities.size(), " values"),
                        absl::StrCat("must be empty or ", components, " per particle (",
                                     frame.ParticleCount(), "), as positions are"));
  }
  for (std::size_t k = 0; k < frame.velocities.size(); ++k) {
    if (std::isfinite(frame.velocities[k])) continue;
    return InvalidFrame(
        kReasonNotFinite,
        CoordinateField("velocities", k / components, static_cast<int>(k % components)),
        ShortestNumber(frame.velocities[k]), "must be finite");
  }
  return absl::OkStatus();
}

// A position in units of 2^-17 cells from the world's origin.
struct Units {
  std::int64_t x, y;
};

Units ToUnits(const WorldPosition& position, double cell_size) {
  return {static_cast<std::int64_t>(std::floor(position.x / cell_size * kUnitsPerCell + 0.5)),
          static_cast<std::int64_t>(std::floor(position.y / cell_size * kUnitsPerCell + 0.5))};
}

struct TileRange {
  std::int32_t x0, x1, y0, y1;  // Inclusive.
};

TileRange TilesReached(Units units, std::int64_t reach) {
  const auto tile = [](std::int64_t coordinate) {
    return static_cast<std::int32_t>(coordinate >> kTileUnitShift);
  };
  return {tile(units.x - reach), tile(units.x + reach), tile(units.y - reach),
          tile(units.y + reach)};
}

template <typename Visit>
void ForEachTile(const TileRange& range, Visit visit) {
  for (std::int32_t y = range.y0; y <= range.y1; ++y) {
    for (std::int32_t x = range.x0; x <= range.x1; ++x) visit(TileCoordinate{y, x});
  }
}

absl::Status CheckDistance(const WorldPosition& position, std::size_t particle, Plane plane,
                           double cell_size) {
  const Axes axes = AxesOf(plane);
  for (const auto& [axis, value] :
       {std::pair(axes.first, position.x), std::pair(axes.second, position.y)}) {
    if (!(std::abs(value / cell_size) <= kMaxCellsFromOrigin)) {
      return InvalidFrame(kReasonOutOfRange, CoordinateField("positions", particle, axis),
                          ShortestNumber(value),
                          absl::StrCat("must be within 2^30 cells of ", ShortestNumber(cell_size),
                                       " from the origin"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

void ParticleBins::Clear() {
  tiles.Clear();
  offsets.clear();
  x.clear();
  y.clear();
  weight.clear();
  source.clear();
}

WorldPosition PositionOf(const Frame& frame, Plane plane, std::size_t particle) {
  const Axes axes = AxesOf(frame, plane);
  return {Coordinate(frame, particle, axes.first), Coordinate(frame, particle, axes.second)};
}

PlaneVelocity VelocityOf(const Frame& frame, Plane plane, std::size_t particle) {
  const Axes axes = AxesOf(frame, plane);
  const float* velocity = frame.velocities.data() + particle * frame.components;
  return {velocity[axes.first], velocity[axes.second]};
}

absl::Status CheckFrame(const Frame& frame, Plane plane, const FrameLimits& limits) {
  const std::size_t values = std::visit([](auto view) { return view.size(); }, frame.positions);
  if (frame.components != 2 && frame.components != 3) {
    return InvalidFrame(kReasonOutOfRange, "components", absl::StrCat(frame.components),
                        "must be 2 or 3");
  }
  if (values % frame.components != 0) {
    return InvalidFrame(kReasonCount, "positions", absl::StrCat(values, " values"),
                        absl::StrCat("must be ", frame.components, " per particle"));
  }
  if (frame.ParticleCount() > limits.max_particles) {
    return ViolationError(
        absl::StatusCode::kResourceExhausted,
        {std::string(kReasonTooManyParticles), "positions",
         absl::StrCat(frame.ParticleCount(), " particles"),
         absl::StrCat("must be at most ", limits.max_particles, " in one frame")});
  }
  if (absl::Status status = CheckCoordinates(frame); !status.ok()) return status;
  if (frame.components == 3 && frame.ParticleCount() > 0) {
    if (absl::Status status = CheckPlanar(frame, plane); !status.ok()) return status;
  }
  if (absl::Status status = CheckVolumes(frame); !status.ok()) return status;
  if (absl::Status status = CheckIds(frame); !status.ok()) return status;
  return CheckVelocities(frame);
}

absl::Status BinParticles(const Frame& frame, Plane plane, const Scale& scale,
                          const FrameLimits& limits, ParticleBins& bins) {
  bins.Clear();
  const std::size_t count = frame.ParticleCount();
  const auto reach = static_cast<std::int64_t>(std::ceil(scale.kernel_radius * kUnitsPerCell));
  // An inside node is within reach of a particle, the rest of an active cell within one cell of
  // it, and any node of a small hole within the radius of a disc of the hole's area of its ring.
  const double margin = 1 + std::sqrt(kHoleMarginParticles / kPi) * scale.spacing;
  const auto tile_reach = reach + static_cast<std::int64_t>(std::ceil(margin * kUnitsPerCell));

  for (std::size_t k = 0; k < count; ++k) {
    const WorldPosition position = PositionOf(frame, plane, k);
    if (absl::Status status = CheckDistance(position, k, plane, scale.cell_size); !status.ok()) {
      return status;
    }
    ForEachTile(TilesReached(ToUnits(position, scale.cell_size), tile_reach),
                [&](TileCoordinate tile) { bins.tiles.Insert(tile); });
    if (bins.tiles.size() > limits.max_tiles) {
      return ViolationError(
          absl::StatusCode::kResourceExhausted,
          {std::string(kReasonTooManyTiles), "positions",
           absl::StrCat("more than ", limits.max_tiles, " tiles of 32 x 32 cells"),
           absl::StrCat("must reach at most ", limits.max_tiles, " tiles: is the spacing of ",
                        ShortestNumber(scale.spacing * scale.cell_size), " right?")});
    }
  }
  bins.tiles.Seal();

  bins.offsets.assign(bins.tiles.size() + 1, 0);
  for (std::size_t k = 0; k < count; ++k) {
    const Units units = ToUnits(PositionOf(frame, plane, k), scale.cell_size);
    ForEachTile(TilesReached(units, reach),
                [&](TileCoordinate tile) { ++bins.offsets[bins.tiles.Find(tile) + 1]; });
  }
  for (std::size_t t = 0; t < bins.tiles.size(); ++t) bins.offsets[t + 1] += bins.offsets[t];

  const std::size_t entries = bins.offsets.back();
  bins.x.resize(entries);
  bins.y.resize(entries);
  bins.source.resize(entries);
  if (!frame.volumes.empty()) bins.weight.resize(entries);
  const double weight_per_world_volume =
      scale.weight_per_volume / scale.cell_size / scale.cell_size;
  for (std::size_t k = 0; k < count; ++k) {
    const Units units = ToUnits(PositionOf(frame, plane, k), scale.cell_size);
    ForEachTile(TilesReached(units, reach), [&](TileCoordinate tile) {
      const std::uint32_t entry = bins.offsets[bins.tiles.Find(tile)]++;
      const auto relative = [](std::int64_t value, std::int32_t origin) {
        return static_cast<float>(value - (std::int64_t{origin} << kTileUnitShift)) * kCellsPerUnit;
      };
      bins.x[entry] = relative(units.x, tile.x);
      bins.y[entry] = relative(units.y, tile.y);
      bins.source[entry] = static_cast<std::uint32_t>(k);
      if (!frame.volumes.empty()) {
        bins.weight[entry] = static_cast<float>(frame.volumes[k] * weight_per_world_volume);
      }
    });
  }
  // Filling moved every offset to the end of its tile, which is the start of the next.
  for (std::size_t t = bins.tiles.size(); t > 0; --t) bins.offsets[t] = bins.offsets[t - 1];
  bins.offsets[0] = 0;
  return absl::OkStatus();
}

}  // namespace partiemc
