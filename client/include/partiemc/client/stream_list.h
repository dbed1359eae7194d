// Lists the open streams of a server.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "partiemc/client/credentials.h"
#include "partiemc/parameters.h"

namespace partiemc::client {

struct StreamSummary {
  std::string stream_id;
  std::string name;
  std::map<std::string, std::string> labels;
  ReconstructionParameters parameters;  ///< Resolved; defaults if this client cannot read them.
  std::uint64_t last_sequence = 0;      ///< Number of the stream's newest frame.
  std::uint64_t frames = 0;             ///< Frames answered by a result.
  std::uint64_t frame_errors = 0;       ///< Frames answered by a refusal.
  std::uint32_t watchers = 0;
  double open_seconds = 0;  ///< Since the stream was opened.
  double idle_seconds = 0;  ///< Since the last message in either direction.
};

/// Requests the list from the server at `address` (HOST:PORT, [IPV6]:PORT or unix:PATH), in the
/// order of opening. Errors: see GetServerInfo.
absl::StatusOr<std::vector<StreamSummary>> ListStreams(
    std::string_view address, std::chrono::milliseconds deadline = std::chrono::seconds(5),
    const Credentials& credentials = {});

}  // namespace partiemc::client
