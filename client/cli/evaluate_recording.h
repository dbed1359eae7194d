// A recording as the evaluation takes it: all frames in memory, with the spacing to measure in.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/sequence.h"
#include "evaluation/sequence.h"

namespace partiemc::client {

/// Reads all selected frames. Where the input knows no spacing, that of the first frame is
/// estimated and `notes` says so.
/// Errors: those of OpenInput and of the frames; FAILED_PRECONDITION with fewer than two frames.
absl::StatusOr<evaluation::Sequence> ReadRecording(const std::string& input,
                                                   const SequenceOptions& options,
                                                   std::vector<std::string>& notes);

}  // namespace partiemc::client
