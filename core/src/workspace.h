// The buffers of all stages, kept warm from frame to frame.
#pragma once

#include <optional>
#include <vector>

#include "bins.h"
#include "crossings.h"
#include "distinct_ids.h"
#include "field.h"
#include "identities.h"
#include "intersections.h"
#include "mesh.h"
#include "normals.h"
#include "partiemc/reconstructor.h"
#include "point_field.h"
#include "rings.h"
#include "spacing.h"
#include "vertices.h"

namespace partiemc {

struct Workspace::Buffers {
  DistinctIdsScratch distinct_ids;
  SpacingScratch spacing;
  ParticleBins bins;
  LevelSet level_set;
  Crossings crossings;
  RingScratch ring_scratch;
  RingTopology topology;
  PointField point_field;
  NormalScratch normal_scratch;
  std::vector<CellPlane> planes;
  std::vector<CellNormal> next_normals;
  PlacedVertices placed;
  std::optional<double> next_area_offset;
  IdentityScratch identity_scratch;
  RingHistory next_history;
  MeshScratch mesh_scratch;
  TouchingPairsBuffers intersections;
};

}  // namespace partiemc
