// Cuts shells of a surface at planes parallel to the coordinate planes, and keeps S1 to S5.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface.h"
#include "space_cut/plane_cut.h"

namespace partiemc::space {

struct SurfaceCutInput {
  /// Shells lose their parts beyond each of these planes. Two planes with the same axis are at
  /// least a millionth of the spacing apart.
  std::span<const AxisPlane> planes;
  /// By shell: whether it is cut. The cavities of a shell that is cut are cut, too. Empty: all are.
  std::span<const std::uint8_t> is_cut;
  /// By shell: the first outer shell of its body, for shells that are images of one body. Empty:
  /// each outer shell is a body.
  std::span<const std::uint32_t> body_of;
  double spacing = 1;  ///< World units.
  /// Planes move to the side that is kept, and the points on a plane that has moved return to the
  /// given plane: all points are exactly on walls or before them. Validate checks the surface then.
  /// If it always fails, the points stay on the plane that has moved.
  bool are_walls = false;
};

/// Warm buffers of CutSurface.
struct SurfaceCutScratch {
  CutMesh mesh;
  PlaneCutScratch plane;
  std::vector<AxisPlane> moved;
  std::vector<std::uint32_t> parent;    // By point of the mesh: union-find.
  std::vector<std::uint32_t> piece_of;  // By point of the mesh: its piece.
  std::vector<std::uint32_t> point_of;  // By point of the mesh: its point of the new surface.
  std::vector<std::uint32_t> largest;   // By shell: the largest piece of the body.
  std::vector<std::uint32_t> next;
  std::vector<std::uint32_t> only;  // By shell: its only outer piece.
  struct PieceSize {
    Vec3 low, high, origin;
    double volume;
    bool is_dust;
  };
  std::vector<PieceSize> sizes;  // By piece.
  Surface surface;
};

/// By shell of the new surface: where it is from.
struct SurfacePieces {
  std::vector<std::uint32_t> sources;  ///< The shell of the given surface, or its outer shell.
  std::vector<std::uint8_t> has_cuts;  ///< It has triangles on a plane.
};

/// Replaces the shells that are cut by their parts. `surface.cuts` lists the triangles on the
/// planes; triangles already listed stay listed. Each part that has triangles on a plane is an
/// outer shell; other parts are whole shells, with their measures. The parts of a shell take its
/// place, those without a point of the given surface come last.
///
/// Parts that are dust are dropped: smaller than 1e-9 of their distance from the origin, or thinner
/// than rounding. Their measures would have no correct digits.
///
/// The largest part of a body has the particles, identity and parents of its outer shell; other
/// parts have none.
///
/// Where a vertex lies on a plane, or rounding leaves a decision open, all planes with the same
/// axis move by the same amount: by up to .0002 spacings and 3e-9 of the coordinate (kShifts in
/// surface_cut.cc); walls by a seventh of it, each to its side. Returns false, with `surface`
/// unchanged, if this does not help, which is a bug. Requires: S1 to S5; `surface.attributes`
/// without values. Deterministic. Cost: linear in the surface, plus CutAtPlane and CapPlanes;
/// ShellsAround if a cavity remains in a shell that falls into several parts.
[[nodiscard]] bool CutSurface(const SurfaceCutInput& input, SurfaceCutScratch& scratch,
                              SurfacePieces& pieces, Surface& surface);

}  // namespace partiemc::space
