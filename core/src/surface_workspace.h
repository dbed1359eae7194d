// The buffers of a surface's stages, kept from frame to frame.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vec3.h"
#include "frame/distinct_ids.h"
#include "partiemc/surface_reconstructor.h"
#include "partiemc/surface_state.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/cleaning.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/mesh.h"
#include "space_certificate/certificate.h"
#include "space_identities/shell_identities.h"
#include "space_images/body_images.h"
#include "space_vertices/drops.h"
#include "space_vertices/thinning.h"
#include "space_vertices/virtual_plane.h"
#include "surface_frame.h"
#include "surface_planes.h"

namespace partiemc {

/// As in SurfaceWorkspace.
struct SurfaceWorkspace::Buffers {
  DistinctIdsScratch distinct_ids;
  space::SpaceBins bins;
  space::SpaceField field;
  space::SpaceCrossings crossings;
  space::Bodies bodies;
  space::CleaningScratch cleaning;
  SurfaceFrameScratch frame;
  space::BodyImageScratch body_images;  // Empty unless particles have copies.
  space::CutShells cut_shells;          // Empty unless particles have copies.
  PlaneCuts plane_cuts;                 // Empty unless walls or a box cut.
  std::vector<Vec3> anchors, positions, normals;
  std::vector<std::uint8_t> is_fixed;
  space::VirtualPlaneScratch virtual_plane;
  space::Certificate certificate;
  std::vector<space::ThinQuad> thin;  // Empty for marching cubes.
  space::Drops drops;
  space::MeshScratch mesh;
  space::ShellIdentityScratch identities;
  ShellHistory next_history;
};

}  // namespace partiemc
