// Matches the area of the outline to the volume of the particles, if the volume is known.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Moves the points of a closed ring by `offset` along the mitres of their segments' normals, to
/// the right of the ring's direction: outward if the inside lies on the left. A mitre is at most
/// twice as long as the offset; a segment of length 0 has no normal and does not count. `points`
/// and `target` are interleaved. `sizes`: a factor of the offset of each point; empty: 1.
/// Requires: at least one point; `target` has the size of `points` and does not overlap it.
void OffsetRing(std::span<const double> points, std::span<const float> sizes, double offset,
                double* target);

/// Moves all vertices along mitred normals by one offset. The target of the offset matches the area
/// to the sum of the volumes, over the components whose outer rings are at least
/// VirtualPlaneConstants::ShortestRing() long. Does nothing if volumes are unknown: neither given
/// nor implied by a given spacing.
///
/// `sizes`: the factor of the offset of each point: its local size, in spacings; with walls, 0 for
/// points on them and 1 for others; empty if all are 1.
///
/// `offset`, in spacings, is the offset of the last frame, if there is one, and becomes the offset
/// of this frame. The size of the offset is limited, since volumes have errors of a few percent.
/// Its change is limited, too, so that outlines do not tremble with their area. The first frame
/// uses the target. `scratch` is a warm buffer. Leaves the measures of the rings undefined. Cost:
/// linear in the points.
void CorrectVolume(const VertexInput& input, std::span<const float> sizes,
                   std::vector<double>& scratch, std::optional<double>& offset, Rings& rings);

}  // namespace partiemc
