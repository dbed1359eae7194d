// What a server tells of itself to Prometheus.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace partiemc::client {

struct ServerFigures {
  double cpu_seconds = 0;
  double memory_bytes = 0;
};

/// Of the text that Prometheus reads; nothing where it lacks one of them.
std::optional<ServerFigures> FiguresIn(std::string_view text);

/// Asks http://HOST:PORT/metrics. Errors: INVALID_ARGUMENT for another form of address,
/// UNAVAILABLE where nobody answers, DATA_LOSS for an answer without the figures.
absl::StatusOr<ServerFigures> AskFigures(const std::string& address);

}  // namespace partiemc::client
