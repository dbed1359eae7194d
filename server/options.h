// The command line of partiemc-server, its environment variables and its config file.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>

#include "server/rpc/health_check.h"
#include "server/server.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

struct CommandLine {
  ServerOptions server;
  /// Finished frames are delivered and streams are ended within this time of SIGTERM.
  std::chrono::milliseconds grace{4000};
  /// For so long after SIGTERM the server serves on, and is no longer ready (Server::SendAway).
  std::chrono::milliseconds drain_delay{0};
  /// Where the address that was bound is written, once the server serves.
  std::optional<std::string> port_file;
  /// The same of the gateway.
  std::optional<std::string> web_port_file;
  /// Only ask the server at this address whether it serves.
  std::optional<Address> health_check;
  HealthCheckSecurity health_check_security;
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
};

/// Nothing is left to do but to print `text` and to leave with `code`.
struct EarlyExit {
  int code = 0;      ///< 0 for --help and --version, 2 for a wrong command line.
  std::string text;  ///< For standard output if `code` is 0, else one line for standard error.
};

std::variant<CommandLine, EarlyExit> ParseCommandLine(int argc, const char* const* argv);

}  // namespace partiemc::server
