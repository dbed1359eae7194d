// Compact surfaces (proto/PROTOCOL.md, "Compact surfaces"): rounded coordinates and normals, and
// arrays compressed by meshoptimizer.
#pragma once

#include "absl/status/status.h"
#include "partiemc/surface.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/result_parts.h"

namespace partiemc::wire {

/// Writes points, triangles, cuts, attributes, `step` and, if `has_normals`, normals. Reorders
/// points and triangles within their shells, so that they compress better. `origin` and `spacing`
/// are in world units. Errors: OUT_OF_RANGE with a Violation (RESOLUTION) if a coordinate is more
/// than 2^30 steps from the origin.
absl::Status EncodeCompact(const Surface& surface, const Origin& origin, double spacing,
                           bool has_normals, v1::Surface& message);

/// Reads the fields that EncodeCompact writes, except cuts. Requires: the caller has copied the
/// offsets of `message` to `surface` and has checked them. Does not check the indices of triangles.
/// Errors: DATA_LOSS for an invalid `step`, arrays that do not decompress, coordinates that are not
/// finite, normals of length 0, and attributes without 1 to 3 components. Allocates no array that
/// its bytes could not fill.
absl::Status DecodeCompact(const v1::Surface& message, const Origin& origin, Surface& surface);

}  // namespace partiemc::wire
