// Encodes and decodes surfaces.
#pragma once

#include "absl/status/status.h"
#include "partiemc/result.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/codec.h"

namespace partiemc::wire {

/// Writes the surface of `result`, the coordinate format and the origin. Errors: as EncodeResult.
absl::Status EncodeSurface(const Result& result, const Outputs& outputs,
                           v1::ReconstructedFrame& message);

/// Replaces offsets, points, triangles, cuts, normals and attributes of the surface in `message`.
/// Keeps coordinate format, origin, measures and identities. Requires: DecodeSurface has read
/// `surface` from `message`, and only points were removed since. Errors: as EncodeResult.
absl::Status ReplaceGeometry(const Surface& surface, double spacing,
                             v1::ReconstructedFrame& message);

/// Reads the surface of `message`, except for its statistics; empties it if there is none. Checks
/// every count and index. Errors: DATA_LOSS.
absl::Status DecodeSurface(const v1::ReconstructedFrame& message, Surface& surface);

}  // namespace partiemc::wire
