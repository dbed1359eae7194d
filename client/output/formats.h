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
std::string EncodePly(const FrameRecord& frame);
std::string EncodeStl(const FrameRecord& frame);
/// With `compress`, as for `FrameWriterOptions::compress_glb`.
std::string EncodeGlb(const FrameRecord& frame, bool compress);
#ifdef PARTIEMC_HAVE_VTK
/// Errors: INTERNAL if VTK's writer fails.
absl::StatusOr<std::string> EncodeVtp(const FrameRecord& frame);
#endif

/// Whether the mesh starts with the points of the rings, bit for bit, so that both can share
/// vertices. Guarantee M3 of result.h states this for all placements except `farthest-particle`.
bool MeshSharesRingPoints(const Result& result);

}  // namespace partiemc::client
