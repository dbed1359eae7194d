// The shells of a frame as sets of lattice nodes, and the shell of each particle.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/surface.h"
#include "periodic/frame_box.h"
#include "periodic/run_periods.h"
#include "space/bins.h"
#include "space/bodies.h"
#include "space/crossings.h"
#include "space/field.h"
#include "space/mesh.h"
#include "space_images/body_images.h"
#include "space_vertices/drops.h"

namespace partiemc::space {

/// The frame and the results of the earlier stages.
struct ShellInput {
  const Frame& frame;
  const SpaceBins& bins;
  const SpaceField& field;
  const SpaceCrossings& crossings;
  const Bodies& bodies;
  const Drops& drops;
  std::span<const ThinQuad> thin;           ///< As MeshInput::thin.
  std::span<const std::uint32_t> shell_of;  ///< By vertex, also of drops (MeshScratch).
  double cell_size;                         ///< World units.
  LatticePeriods periods = {};
  /// The shells that will be cut at the faces of a periodic box; null or empty if there are none.
  const CutShells* cut = nullptr;
  Vec3 low = {}, high = {};   ///< With `cut`: the box in cells; infinite along axes without copies.
  BoxMotion box_motion = {};  ///< Motion of the box since the last frame, in cells.
  std::optional<PeriodicBox> box_to_store = std::nullopt;  ///< For ShellHistory::box.
};

/// The shells of a frame, numbered from 0 in the order of their first runs: by layer, row, node.
struct NumberedShells {
  std::vector<KnownShell> shells;        ///< By number; KnownShell::outer is a number.
  std::vector<std::uint64_t> particles;  ///< By number.
  /// By shell of the surface: its number. kNoShell for cavities of cut bodies that do not lie in
  /// the box.
  std::vector<std::uint32_t> number;
  std::vector<std::uint32_t> of_particle;    ///< By particle of the bins: number, or kNoShell.
  std::vector<std::uint32_t> surface_shell;  ///< By number: its (first) shell of the surface.

  struct Edge {
    std::int32_t layer, row, node;  // Its lower node.
    std::uint32_t shell;            // Index in the surface.
    bool begins_inside;
  };
  std::vector<Edge> edges;                   ///< Scratch: the crossed edges along x.
  std::vector<std::uint32_t> shell_of_body;  ///< Scratch: by body, its outer shell.
  /// Scratch: by shell, the shell whose number it gets: itself, or for an image of a cut body the
  /// first image. kNoShell: no number.
  std::vector<std::uint32_t> stand_in;
};

/// Collects the runs of the shells, with numbers, and sets all members of `shells`.
///
/// A run is the consecutive nodes of a row between two crossed edges. A run of inside nodes belongs
/// to the outer shell of its body. A run of outside nodes belongs to a cavity if one of the crossed
/// edges at its ends is on the shell of the cavity. An ellipsoid has the nodes of its body. If it
/// replaces a particle without a body, it has one node, the lowest of the particle's cell
/// (space_vertices/drops.h).
///
/// If a body will be cut, only its nodes in the box count, and all its images have one number.
/// Cost: n log n in the crossed edges along x, linear in particles and shells.
void NumberShells(const ShellInput& input, const Surface& surface, NumberedShells& shells,
                  std::vector<ShellRun>& runs);

}  // namespace partiemc::space
