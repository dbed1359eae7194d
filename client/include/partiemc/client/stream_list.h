// The streams that are open on a server now.
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
  ReconstructionParameters parameters;  ///< As resolved.
  std::uint64_t last_sequence = 0;      ///< The last number that the stream has used up.
  std::uint64_t frames = 0;             ///< Answered by a result.
  std::uint64_t frame_errors = 0;
  std::uint32_t watchers = 0;
  double open_seconds = 0;
  double idle_seconds = 0;
};

/// Asks the server at `address` (HOST:PORT, [IPV6]:PORT or unix:PATH), in the order of opening.
/// Errors: those of GetServerInfo.
absl::StatusOr<std::vector<StreamSummary>> ListStreams(
    std::string_view address, std::chrono::milliseconds deadline = std::chrono::seconds(5),
    const Credentials& credentials = {});

}  // namespace partiemc::client
