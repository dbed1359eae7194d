// Reads processor time and memory of a server from its metrics.
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

/// Finds the two figures in text format of Prometheus, after its first line (an HTTP response has
/// header lines there). Empty if a figure is missing.
std::optional<ServerFigures> FiguresIn(std::string_view text);

/// Requests http://HOST:PORT/metrics. Errors: INVALID_ARGUMENT for another form of address,
/// UNAVAILABLE without a connection, DATA_LOSS without a response that has the figures.
absl::StatusOr<ServerFigures> AskFigures(const std::string& address);

}  // namespace partiemc::client
