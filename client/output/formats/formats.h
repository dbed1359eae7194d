// The encoders behind EncodeFrame, one source file each. All require finite coordinates.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/output/frame_writer.h"

namespace partiemc::client {

// These require a record without a surface.
std::string EncodeGeoJson(const FrameRecord& frame);
std::string EncodeSvg(const FrameRecord& frame, const FrameWriterOptions& options);
std::string EncodeCsv(const FrameRecord& frame);

/// Requires: frame.surface.
std::string EncodeSurfaceSvg(const FrameRecord& frame, const FrameWriterOptions& options);

// These write outlines and surfaces.
std::string EncodeObj(const FrameRecord& frame);
std::string EncodePly(const FrameRecord& frame);
std::string EncodeStl(const FrameRecord& frame);
/// With `compress`, as for `FrameWriterOptions::compress_glb`.
/// Errors: OUT_OF_RANGE for a file of more than 4 GiB.
absl::StatusOr<std::string> EncodeGlb(const FrameRecord& frame, bool compress);
#ifdef PARTIEMC_HAVE_VTK
/// Errors: INTERNAL if VTK's writer fails.
absl::StatusOr<std::string> EncodeVtp(const FrameRecord& frame);
#endif

}  // namespace partiemc::client
