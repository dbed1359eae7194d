// Cuts shells of a surface at planes parallel to the coordinate planes. The result has the
// guarantees S1 to S5 (partiemc/surface.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "partiemc/surface.h"
#include "space_cut/plane_cut.h"

namespace partiemc::space {

struct SurfaceCutInput {
  /// Shells lose their parts beyond each plane. Requires: planes with the same axis are at least a
  /// millionth of the spacing apart, and all or none of them are walls.
  std::span<const AxisPlane> planes;
  /// By shell: whether it is cut. Empty: all are. Requires: the same value for a shell and its
  /// cavities.
  std::span<const std::uint8_t> is_cut;
  /// By shell: the first outer shell of its body, the same one for all images of a body. Empty:
  /// each outer shell is a body.
  std::span<const std::uint32_t> body_of;
  double spacing = 1;  ///< World units.
  /// Step of the inner points of the faces on the planes, world units; 0 for no inner points.
  double inner_step = 0;
};

/// Warm buffers of CutSurface.
struct SurfaceCutScratch {
  CutMesh mesh;
  PlaneCutScratch plane;
  std::vector<AxisPlane> moved;
  std::vector<std::uint32_t> parent;    // By point of the mesh: the union-find of pieces.
  std::vector<std::uint32_t> piece_of;  // By point of the mesh: its piece.
  std::vector<std::uint32_t> point_of;  // By point of the mesh: its point of the new surface.
  std::vector<std::uint32_t> largest;   // By body (body_of): its largest piece.
  std::vector<std::uint32_t> next;
  std::vector<std::uint32_t> only;  // By given shell: its outer piece, if it has only one.
  struct PieceSize {
    Vec3 low, high, origin;
    double volume;
    bool is_dust;
  };
  std::vector<PieceSize> sizes;  // By piece.
  Surface surface;
};

/// By shell of the new surface.
struct SurfacePieces {
  /// The given shell of which the new shell is a part. If the new shell has triangles on a plane:
  /// the outer shell of that given shell.
  std::vector<std::uint32_t> sources;
  std::vector<std::uint8_t> has_cuts;  ///< Whether it has triangles on a plane.
};

/// Replaces each shell that crosses a plane with its parts. `surface.cuts` lists the triangles on
/// the planes; triangles already listed stay listed. Each part that has triangles on a plane is an
/// outer shell. A part without such triangles is a whole shell, and keeps area, volume and
/// centroid. The parts of a shell take its place; parts without a point of the given surface come
/// last.
///
/// Drops dust: parts with triangles on a plane whose size is below 1e-9 of their distance from the
/// origin, or whose volume is below 1e-14 of their cubed size. Their measures would have no correct
/// digits.
///
/// Of the outer parts of a body, the largest gets the particles, identity and parents of the body's
/// first outer shell; the others get none. Whole cavities keep theirs.
///
/// If a vertex lies on a plane, or rounding leaves a decision open, all faces of a box move, or all
/// walls. Faces with the same axis move alike, by up to .00021 spacings plus 3e-9 of their largest
/// coordinate (kShifts in surface_cut.cc). Walls move each on its own, to the side that is kept. If
/// there are walls, all planes move by at most a sixth of this. The points on a moved wall return
/// to the wall, if Validate accepts this surface. If Validate rejects it for every move, they stay
/// on the moved wall. Returns false, with `surface` unchanged, if this does not help, which is a
/// bug.
/// Requires: S1 to S5; `surface.attributes` without values. Deterministic. Cost: linear in the
/// surface, plus CutAtPlane and CapPlanes, plus ShellsAround if a shell with a cavity falls into
/// several parts. Throws Cancelled as ThrowIfCancelled, with `surface` unchanged.
[[nodiscard]] bool CutSurface(const SurfaceCutInput& input, SurfaceCutScratch& scratch,
                              SurfacePieces& pieces, Surface& surface);

}  // namespace partiemc::space
