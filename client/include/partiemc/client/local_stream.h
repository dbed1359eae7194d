// The core in this process behind the interface of a stream: same frames, same answers, same bits
// as from a server, without one.
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
  /// Threads that reconstruct, at least 1. 0: one for each processor.
  int threads = 0;
  /// Frames that wait or are in work, at least 1. 2 lets the caller read the next one meanwhile.
  std::size_t frames_in_flight = 2;
  /// As StreamOptions::send_timeout (stream.h). Absent: no limit, as the work is done by this
  /// process itself.
  std::optional<std::chrono::milliseconds> send_timeout = {};
};

class LocalStream : public FrameStream {
 public:
  /// Errors: INVALID_ARGUMENT, see Validate(ReconstructionParameters).
  static absl::StatusOr<std::unique_ptr<LocalStream>> Open(const LocalStreamOptions& options);

  /// Waits for the frame in work, drops the others. No call may be under way.
  ~LocalStream() override = default;
};

}  // namespace partiemc::client
