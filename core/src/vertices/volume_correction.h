// Matches the area of the outline to the volume of the particles, if the volume is known.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "partiemc/result.h"
#include "vertices/vertices.h"

namespace partiemc {

/// Moves the points of a closed ring by `offset` along the mitres of their segments' normals. A
/// positive offset moves to the right of the ring's direction: outward if the inside is on the
/// left. A mitre is at most twice as long as the offset. Segments of length 0 do not count.
/// `points` and `target` are interleaved. `factors`: by point, of the offset; empty if all are 1.
/// Requires: at least one point; `target` has the size of `points` and does not overlap it.
void OffsetRing(std::span<const double> points, std::span<const float> factors, double offset,
                double* target);

struct PointSizes {
  std::span<const float> local;    ///< By point: the local size, in spacings; empty if all are 1.
  std::span<const float> factors;  ///< By point: the factor of its offset. The local size; 0 for
                                   ///< points on walls. Empty if all are 1.
};

/// Moves the points of all rings along mitred normals by one offset. The target is the offset at
/// which the area equals the sum of the volumes. Only components count whose outer rings are at
/// least VirtualPlaneConstants::ShortestRing() spacings long. In frames with copies of particles,
/// components with Fate::kGone do not count, and components with Fate::kCut count by their part in
/// the window. Does nothing if volumes are unknown (neither given nor implied by a given spacing),
/// or if VirtualPlaneSteps::area is off.
///
/// `offset`, in spacings, is the offset of the last frame and becomes the offset of this frame. The
/// target is limited, because volumes have errors of a few percent. The change of the offset is
/// limited, too, so that outlines do not tremble. A frame without an earlier offset uses the
/// target. If no component counts, the last offset, if there is one, is applied again.
/// `scratch` is a warm buffer. Leaves the measures of the rings undefined. Cost: linear in points.
void CorrectVolume(const VertexInput& input, const PointSizes& sizes, std::vector<double>& scratch,
                   std::optional<double>& offset, Rings& rings);

}  // namespace partiemc
