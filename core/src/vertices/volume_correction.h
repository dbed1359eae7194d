// The area of the outline matched to the volume of the particles, where that is known.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Writes to `target` the points of a closed ring, interleaved, moved by `offset` along the mitres
/// of their segments: to the right of its way, so outward where the inside lies on the left. A
/// mitre is at most twice as long as the offset; a segment of length 0 has no direction. Requires:
/// at least one point, room for as many in `target`, which is not `points`.
void OffsetRing(std::span<const double> points, double offset, double* target);

/// Moves all vertices along mitred normals by one offset, so that the area of the components whose
/// outlines are at least VirtualPlaneConstants::ShortestRing() long approaches the sum of their
/// volumes. Does nothing where volumes are unknown: neither given nor implied by a given spacing.
///
/// The offset is bounded, as volumes are off by some percent, and changes by little from frame to
/// frame, so that outlines do not tremble with their area: `offset`, in spacings, is that of the
/// frame before (nothing at first: then this frame's alone) and becomes this frame's.
/// Cost: linear in the points. Leaves the rings' measures undefined.
/// `scratch` is a warm buffer.
void CorrectVolume(const VertexInput& input, std::vector<double>& scratch,
                   std::optional<double>& offset, Rings& rings);

}  // namespace partiemc
