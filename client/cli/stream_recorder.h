// `partiemc watch --record`: records the particles that a producer sends. If the recording has all
// frames of the stream, its replay has the same results, bit for bit, except for streams with an
// isovalue.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/recording/recording.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {

/// Writes the echoed particles of a watched stream, as float64. Not thread-safe. Memory: one block
/// of a recording.
class StreamRecorder {
 public:
  /// Errors: as RecordingWriter::Create.
  static absl::StatusOr<StreamRecorder> Create(const std::string& path,
                                               const std::string& stream_name,
                                               const WatchedStream& stream);

  /// Writes the particles of `frame`. Takes its buffers during the call and returns them unchanged.
  /// Errors: FAILED_PRECONDITION if the producer does not echo its particles; the errors of
  /// RecordingWriter.
  absl::Status Add(WatchedFrame& frame);

  /// Completes the file. Does nothing if no frame was added.
  absl::Status Finish();

  /// Returns lines for a user: the number of frames and the command that replays the recording. If
  /// frames are missing or the stream has an isovalue, further lines state that a replay differs.
  std::string Summary() const;

 private:
  StreamRecorder(std::string path, const ReconstructionParameters& parameters,
                 std::unique_ptr<RecordingWriter> writer);

  std::string path_;
  std::string flags_;       // For `partiemc replay`.
  std::string attributes_;  // The flag with the attributes of the results, or empty.
  bool has_isovalue_;
  std::unique_ptr<RecordingWriter> writer_;
  RecordedFrame frame_;
  std::uint64_t first_sequence_ = 0, missed_ = 0;
};

/// Returns the flags of `partiemc replay` for parameters that differ from the defaults, each after
/// a space. Leaves out a given spacing, which the recording holds, and an isovalue, which has no
/// flag.
std::string ReplayFlagsOf(const ReconstructionParameters& parameters);

}  // namespace partiemc::client
