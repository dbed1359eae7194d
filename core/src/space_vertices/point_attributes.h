// Interpolates attributes of particles to the points of a surface.
#pragma once

#include <span>
#include <vector>

#include "frame/scale.h"
#include "partiemc/frame.h"
#include "partiemc/result.h"
#include "space/bins.h"

namespace partiemc::space {

/// Interpolates the attributes of the particles to `points`, which are interleaved, in world units.
/// `values` receives one entry for each attribute of `frame`, in the same order, and reuses its
/// buffers.
///
/// Moving least squares as for outlines (attributes/attributes.h), over x, y and z: fits a linear
/// function to the particles whose kernels reach a point and evaluates it there. Ignores mirror
/// images. A point that no kernel reaches gets the value 0.
///
/// Requires: a checked frame; bins of this frame. Sums run in the order of the bins, so they do not
/// depend on the order of the frame. Parallel over points. Cost: linear in the particles that reach
/// each point.
void InterpolateInSpace(const Frame& frame, const SpaceBins& bins, const Scale& scale,
                        std::span<const double> points, std::vector<AttributeValues>& values);

}  // namespace partiemc::space
