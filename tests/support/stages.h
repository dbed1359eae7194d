// Runs the stages with access to intermediate results, also on level sets written by hand. For
// tests of the core only: it includes private headers.
#pragma once

#include <functional>
#include <vector>

#include "bins/bins.h"
#include "core/internal/research.h"
#include "crossings/crossings.h"
#include "field/field.h"
#include "frame/scale.h"
#include "mesh/mesh.h"
#include "normals/normals.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"
#include "support/particles.h"
#include "vertices/vertices.h"

namespace partiemc::support {

/// A level set with values of `function` at nodes (column, row).
LevelSet LevelSetOf(const std::function<double(int, int)>& function, const TileDirectory& tiles);

/// Outputs of the stages for one frame. Not movable after a run: later results refer to earlier
/// ones.
struct Stages {
  ReconstructionParameters parameters;  ///< Resolved.
  VirtualPlaneVariant variant;          ///< Set before Run.
  Scale scale;
  Particles particles;
  ParticleBins bins;
  LevelSet level_set;
  Crossings crossings;
  RingScratch ring_scratch;
  RingTopology topology;
  LevelSetSampler field;
  NormalScratch normal_scratch;
  std::vector<CellPlane> planes;
  std::vector<CellNormal> next_normals;
  VertexScratch vertex_scratch;
  PlacedVertices placed;
  MeshScratch mesh_scratch;
  Result result;

  Stages() = default;
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;

  /// Runs all stages except identities on `particles`; parameters need a spacing.
  void Run(const Particles& frame, const ReconstructionParameters& wanted,
           std::span<const CellNormal> previous = {});

  /// Same from stage 3 on, for a level set with values of `function` at nodes (column, row) on the
  /// tiles [low, high]. Particles count for components and the point field only. Nodes in the
  /// outermost row and column of tiles must be outside.
  void RunOn(const std::function<double(int, int)>& function, TileCoordinate low,
             TileCoordinate high, const Particles& frame, const ReconstructionParameters& wanted,
             std::span<const CellNormal> previous = {});

  /// Stages 3 and 4 of such a level set.
  void TraceOn(const std::function<double(int, int)>& function, TileCoordinate low,
               TileCoordinate high, const Particles& frame, const ReconstructionParameters& wanted);

  /// Value at each corner of an active cell.
  std::array<double, 4> CornerValues(const ActiveCell& cell) const;

 private:
  void SetScale(const ReconstructionParameters& wanted);
  void Trace();
  void RunFromRings(std::span<const CellNormal> previous);
};

/// The cell of point `k` of the rings.
inline const ActiveCell& CellOf(const Stages& stages, std::size_t k) {
  return stages.crossings.cells[stages.crossings.segments[stages.topology.segments[k]].cell];
}

}  // namespace partiemc::support
