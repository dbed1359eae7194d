// `partiemc streams`: lists the open streams of a server.
#pragma once

#include <span>
#include <string>

#include "client/cli/server_flags.h"
#include "partiemc/client/stream_list.h"

namespace CLI {
class App;
}

namespace partiemc::client {

CLI::App* AddStreams(CLI::App& app, QueryFlags& flags);

/// Returns the exit code.
int Streams(const QueryFlags& flags);

/// Returns an aligned table for a person to read; every line ends in '\n'.
std::string StreamsText(std::span<const StreamSummary> streams);

std::string StreamsJson(std::span<const StreamSummary> streams, const std::string& address);

}  // namespace partiemc::client
