#include "support/stages.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "frame_lengths.h"

namespace partiemc::support {

LevelSet LevelSetOf(const std::function<double(int, int)>& function, const TileDirectory& tiles) {
  LevelSet level_set;
  level_set.void_value = 1;
  level_set.tiles.resize(tiles.size());
  level_set.inside.resize(tiles.size());
  for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
    for (int node = 0; node < kTileNodes; ++node) {
      const int i = node % kTileSize;
      const int j = node / kTileSize;
      const auto value = static_cast<float>(
          function(tiles[tile].x * kTileSize + i, tiles[tile].y * kTileSize + j));
      level_set.tiles[tile][node] = value;
      level_set.inside[tile][j] |= static_cast<std::uint32_t>(value < 0) << i;
    }
  }
  return level_set;
}

void Stages::SetScale(const ReconstructionParameters& wanted) {
  parameters = Resolve(wanted);
  const double spacing = parameters.spacing.value();
  double lightest = spacing * spacing;
  if (!particles.volumes.empty()) {
    lightest = *std::min_element(particles.volumes.begin(), particles.volumes.end());
  }
  const double cell_size = CellUnit(parameters) * parameters.cell_size * spacing;
  if (parameters.sizes == Sizes::kOwn) {
    const auto sizes =
        RangeOfSizes(particles.AsFrame(), parameters, {.spacing = spacing, .cell_size = cell_size});
    ASSERT_TRUE(sizes.ok()) << sizes.status();
    scale = MakeScale(parameters, spacing, cell_size, spacing * spacing, *sizes);
    return;
  }
  scale = MakeScale(parameters, spacing, cell_size, lightest);
}

void Stages::Run(const Particles& frame, const ReconstructionParameters& wanted,
                 std::span<const CellNormal> previous) {
  particles = frame;
  SetScale(wanted);
  const absl::Status status = BinParticles(particles.AsFrame(), parameters.plane, scale, {}, bins);
  ASSERT_TRUE(status.ok()) << status;
  SampleField(bins, scale, level_set);
  Trace();
  RunFromRings(previous);
}

void Stages::RunOn(const std::function<double(int, int)>& function, TileCoordinate low,
                   TileCoordinate high, const Particles& frame,
                   const ReconstructionParameters& wanted, std::span<const CellNormal> previous) {
  TraceOn(function, low, high, frame, wanted);
  RunFromRings(previous);
}

void Stages::TraceOn(const std::function<double(int, int)>& function, TileCoordinate low,
                     TileCoordinate high, const Particles& frame,
                     const ReconstructionParameters& wanted) {
  particles = frame;
  SetScale(wanted);
  bins.Clear();
  for (std::int32_t y = low.y; y <= high.y; ++y) {
    for (std::int32_t x = low.x; x <= high.x; ++x) bins.tiles.Insert({y, x});
  }
  bins.tiles.Seal();
  level_set = LevelSetOf(function, bins.tiles);
  bins.offsets = {0};
  for (std::size_t tile = 0; tile < bins.tiles.size(); ++tile) {
    const int column = bins.tiles[tile].x * kTileSize;
    const int row = bins.tiles[tile].y * kTileSize;
    for (std::size_t k = 0; k < particles.size(); ++k) {
      const double px = particles.x(k) / scale.cell_size - column;
      const double py = particles.y(k) / scale.cell_size - row;
      if (std::min(px, py) < 0 || std::max(px, py) >= kTileSize) continue;
      const float last = std::nextafter(static_cast<float>(kTileSize), 0.0f);
      bins.particles.push_back({std::min(static_cast<float>(px), last),
                                std::min(static_cast<float>(py), last),
                                static_cast<std::uint32_t>(k)});
    }
    bins.offsets.push_back(static_cast<std::uint32_t>(bins.particles.size()));
  }
  Trace();
}

void Stages::Trace() {
  FindCrossings(bins.tiles, level_set, crossings);
  TraceRings(bins, level_set, scale, parameters, crossings, ring_scratch, topology);
}

void Stages::RunFromRings(std::span<const CellNormal> previous) {
  field.Build(bins, crossings, scale, scale.kernel_radius + 1, true);
  EstimateNormals({bins, crossings, topology, field, parameters}, previous, normal_scratch, planes,
                  next_normals);
  const Frame frame = particles.AsFrame();
  std::optional<double> area_offset;
  ASSERT_TRUE(PlaceVertices(
      {frame, bins, level_set, crossings, topology, field, planes, parameters, variant, scale},
      area_offset, vertex_scratch, placed, result.rings));
  ASSERT_TRUE(
      BuildMesh({bins.tiles, crossings, topology, planes, placed, result.rings, parameters, scale},
                mesh_scratch, result.mesh, result.statistics));
}

std::array<double, 4> Stages::CornerValues(const ActiveCell& cell) const {
  const auto at = [&](int di, int dj) {
    return static_cast<double>(level_set.At(bins.tiles, cell.tile, cell.i + di, cell.j + dj));
  };
  return {at(0, 0), at(1, 0), at(1, 1), at(0, 1)};
}

}  // namespace partiemc::support
