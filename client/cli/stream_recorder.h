// `partiemc watch --record`: what a stream's producer sent, as a recording that replays to the same
// bits.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/recording/recording.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {

/// Writes the echoed particles of a watch, in float64. One thread; memory: one block of a
/// recording.
class StreamRecorder {
 public:
  /// Errors: those of RecordingWriter::Create.
  static absl::StatusOr<StreamRecorder> Create(const std::string& path,
                                               const std::string& stream_name,
                                               const WatchedStream& stream);

  /// Takes the arrays of the particles out of `frame`, and puts them back.
  /// Errors: FAILED_PRECONDITION where the producer does not echo its particles; those of
  /// RecordingWriter.
  absl::Status Add(WatchedFrame& frame);

  /// The file appears, unless there was no frame.
  absl::Status Finish();

  /// Lines for a person: where the recording lies, how it is replayed, and why that would not give
  /// the same bits, if it would not.
  std::string Summary() const;

 private:
  StreamRecorder(std::string path, std::string flags, std::unique_ptr<RecordingWriter> writer)
      : path_(std::move(path)), flags_(std::move(flags)), writer_(std::move(writer)) {}

  std::string path_;
  std::string flags_;  // Of `partiemc replay`.
  std::unique_ptr<RecordingWriter> writer_;
  RecordedFrame frame_;
  std::uint64_t first_sequence_ = 0, missed_ = 0;
};

/// The flags of `partiemc replay` that differ from its defaults, each behind a space; the spacing
/// is left out where it is given, as recordings hold it.
std::string ReplayFlagsOf(const ReconstructionParameters& parameters);

}  // namespace partiemc::client
