// Attributes of particles in space -> values at the points of the surface.
#pragma once

#include <span>
#include <vector>

#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/result.h"
#include "space/bins.h"

namespace partiemc::space {

/// Interpolates the attributes of the particles to `points`, interleaved, in world units. `values`
/// receives one entry for each attribute of `frame`, in the same order, and reuses its buffers.
///
/// Moving least squares as for outlines (attributes/attributes.h), over x, y and z: fits a linear
/// function to the particles within the kernel radius and evaluates it at the point. A point
/// without a particle within the kernel radius gets the value 0.
///
/// Requires: a checked frame; bins of this frame. Sums run in the order of the bins, so they do not
/// depend on the order of the frame. Parallel over points. Cost: linear in the particles within the
/// kernel radius of each point.
void InterpolateInSpace(const Frame& frame, const SpaceBins& bins, const Scale& scale,
                        std::span<const double> points, std::vector<AttributeValues>& values);

}  // namespace partiemc::space
