// Runs the core in this process behind the interface of a stream. Results have the same bits as a
// server's.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

struct LocalStreamOptions {
  ReconstructionParameters parameters = {};
  std::vector<std::string> attributes = {};  ///< As Outputs::attributes (stream.h).
  FrameLimits limits = {};
  /// Number of compute threads; 0 or less: one per processor.
  int threads = 0;
  /// Maximum number of frames that wait or are being computed, at least 1. With 2, the caller can
  /// read the next frame while the current one is computed.
  std::size_t frames_in_flight = 2;
  /// Same as StreamOptions::send_timeout (stream.h); absent: no limit.
  std::optional<std::chrono::milliseconds> send_timeout = {};
};

class LocalStream : public FrameStream {
 public:
  /// Errors: INVALID_ARGUMENT, see Validate(ReconstructionParameters).
  static absl::StatusOr<std::unique_ptr<LocalStream>> Open(const LocalStreamOptions& options);

  /// Waits for the frame that is being computed and drops waiting frames. No call may be in
  /// progress.
  ~LocalStream() override = default;
};

}  // namespace partiemc::client
