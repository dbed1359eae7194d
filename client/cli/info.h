// `partiemc info`: prints the version, limits and load of a server.
#pragma once

#include <string>

#include "client/cli/server_flags.h"
#include "partiemc/client/server_info.h"

namespace CLI {
class App;
}

namespace partiemc::client {

CLI::App* AddInfo(CLI::App& app, QueryFlags& flags);

/// Returns the exit code.
int Info(const QueryFlags& flags);

/// Returns aligned lines for a person to read; every line ends in '\n'.
std::string InfoText(const ServerInfo& info, const ServerFlags& server);

std::string InfoJson(const ServerInfo& info, const ServerFlags& server);

}  // namespace partiemc::client
