// The encoders behind EncodeFrame, one source file each. All require finite coordinates.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/output/frame_writer.h"

namespace partiemc::client {

std::string EncodeGeoJson(const FrameRecord& frame);
std::string EncodeSvg(const FrameRecord& frame, const FrameWriterOptions& options);
std::string EncodeObj(const FrameRecord& frame);
std::string EncodeCsv(const FrameRecord& frame);
#ifdef PARTIEMC_HAVE_VTK
/// Errors: INTERNAL when VTK's writer fails.
absl::StatusOr<std::string> EncodeVtp(const FrameRecord& frame);
#endif

/// Whether the mesh begins with the points of the rings, bit for bit (guarantee M3 of result.h,
/// which `farthest-particle` may break), so that both can share their vertices.
bool MeshSharesRingPoints(const Result& result);

}  // namespace partiemc::client
