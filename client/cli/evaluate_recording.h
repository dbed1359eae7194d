// A recording as the evaluation takes it: all frames in memory, with the spacing to measure in.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/evaluation/scenes/sequence.h"
#include "client/input/sequence.h"

namespace partiemc::client {

/// Reads all selected frames. Where the input knows no spacing, that of the first frame is
/// estimated and `notes` says so. What is known of NAME.pemc is taken from NAME.truth beside it, if
/// there is one (evaluation/recorded_truth.h).
/// Errors: those of OpenInput and of the frames; FAILED_PRECONDITION with fewer than two frames, or
/// where NAME.truth says something else than facts.
absl::StatusOr<evaluation::Sequence> ReadRecording(const std::string& input,
                                                   const SequenceOptions& options,
                                                   std::vector<std::string>& notes);

/// The recordings (.pemc) in a folder, by name. Errors: FAILED_PRECONDITION without any.
absl::StatusOr<std::vector<std::string>> RecordingsIn(const std::string& directory);

}  // namespace partiemc::client
