// Where the vertex of one cell goes, for each placement (paper, sections 3.4-3.5).
#pragma once

#include "vertices.h"

namespace partiemc {

/// `point` moved into the cell of `segment`, a little away from its sides; in a saddle into the
/// half of the cell that belongs to the segment, so that its two segments never meet.
LatticePoint ClampToCell(const TileDirectory& directory, const Crossings& crossings,
                         std::uint32_t segment, LatticePoint point);

/// `point`, where F has this value and gradient, moved by one Newton step towards F = 0, of at most
/// `max_step` cells; `point` itself where the gradient is weak.
LatticePoint NewtonStep(LatticePoint point, double value, LatticePoint gradient, double max_step);

/// One Newton step from the middle of the segment to F = 0 along the cell plane's normal, of at
/// most half a cell; none where the gradient is weak. In lattice coordinates.
LatticePoint VirtualPlaneVertex(const CellPlane& plane);

/// Minimiser of sum_j (n_j . (v - p_j))^2 over the segment's two ends (Eq. 14), in closed form;
/// directions that the normals hardly constrain stay at the middle. In lattice coordinates.
LatticePoint QefVertex(const VertexInput& input, std::uint32_t segment, const CellPlane& plane);

/// The particle that lies farthest along the plane's normal, among those on or above the plane and
/// within one cell (and one kernel radius) of its point; the middle of the segment if there is
/// none. In world units, moved outward by the surface offset.
WorldPosition FarthestParticleVertex(const VertexInput& input, std::uint32_t segment,
                                     const CellPlane& plane);

}  // namespace partiemc
