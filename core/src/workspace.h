// The buffers of all stages, reused from frame to frame.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "attributes/attributes.h"
#include "bins/bins.h"
#include "crossings/crossings.h"
#include "cut/ring_cut.h"
#include "field/field.h"
#include "filter/noise_filter.h"
#include "frame/distinct_ids.h"
#include "frame/scale.h"
#include "frame/slab.h"
#include "frame/spacing.h"
#include "frame_lengths.h"
#include "identities/identities.h"
#include "mesh/mesh.h"
#include "normals/normals.h"
#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "partiemc/surface_reconstructor.h"
#include "periodic/lift.h"
#include "phases/phases.h"
#include "rings/body_choice.h"
#include "rings/rings.h"
#include "sampler/level_set_sampler.h"
#include "vertices/vertices.h"
#include "walls/wall_copies.h"
#include "walls/wall_corners.h"
#include "walls/wall_field.h"
#include "walls/wall_particles.h"

namespace partiemc {

// The next state of an outline. It is committed only when all outlines of the frame are done.
struct NextState {
  bool is_kept = false;  // False: the stream keeps its old state.
  State state;
};

// The last outline of ReconstructOutline, for ReconstructPhase.
struct LastOutline {
  Frame frame;                     // Its particles.
  std::optional<Lengths> lengths;  // Empty: the spacing is unknown, so no rings.
  Scale scale;
  Doubts doubts;
  std::optional<Percolation> percolation;  // Absent without copies of particles.
  int cut_steps = 0;                       // Of CutRings.
};

struct Workspace::Buffers {
  DistinctIdsScratch distinct_ids;
  SpacingScratch spacing;
  LiftScratch lift;  // Empty without a periodic box.
  BodyChoice choice;
  RingCutScratch ring_cut;   // Empty unless bodies are cut.
  NoiseFilterScratch noise;  // Empty without a noise filter.
  Slab slab;
  ParticleBins bins;
  LevelSet level_set;
  WallField walls;               // Empty without walls.
  WallParticles wall_particles;  // Empty unless particles of some phases are walls.
  WallCopies wall_copies;        // Empty unless a periodic box has walls.
  NextState wall_state;          // Of wall particles. It is never committed.
  Result wall_result;
  WallCornerScratch wall_corners;
  Crossings crossings;
  RingScratch ring_scratch;
  RingTopology topology;
  LevelSetSampler sampler;
  NormalScratch normal_scratch;
  std::vector<CellPlane> planes;
  std::vector<CellNormal> next_normals;
  VertexScratch vertex_scratch;
  PlacedVertices placed;
  std::optional<double> next_area_offset;
  IdentityScratch identity_scratch;
  RingHistory next_history;
  MeshScratch mesh_scratch;
  AttributeScratch attribute_scratch;
  std::vector<AttributeValues> node_attributes;  // At the nodes where blocks are tested.
  std::vector<NextState> next_states;            // By outline: the main one, then the sections.
  LastOutline last;
  Phases phases;                      // Empty unless sections have phases.
  std::vector<Attribute> attributes;  // Without the attribute of the phases.
  PlacedVertices placed_phase;
  Rings phase_rings;  // Of CanCutPhases.
  SurfaceWorkspace surface;
};

}  // namespace partiemc
