// The area of the outline matched to the volume of the particles, where that is known.
#pragma once

#include <optional>
#include <vector>

#include "partiemc/result.h"
#include "vertices.h"

namespace partiemc {

/// Moves all vertices along mitred normals by one offset, so that the area of the components of
/// thirty particles and more approaches the sum of their volumes. Does nothing where volumes are
/// unknown: neither given nor implied by a given spacing.
///
/// The offset is at most 0.15 spacings, and fades where much more is wanted, which is a sign that
/// the volumes are not those of this outline. It follows the frames' wishes by nine tenths of the
/// difference a frame: `offset`, in spacings, is the one of the frame before (nothing at first) and
/// becomes this frame's.
/// Cost: linear in the points.
/// `scratch` is a warm buffer.
void MatchArea(const VertexInput& input, std::vector<double>& scratch,
               std::optional<double>& offset, Rings& rings);

}  // namespace partiemc
