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
  /// Time after SIGTERM for delivering finished frames and ending streams.
  std::chrono::milliseconds grace{4000};
  /// Time after SIGTERM in which the server still serves but reports that it is not ready
  /// (Server::SendAway).
  std::chrono::milliseconds drain_delay{0};
  /// File for the bound address, written when the server serves.
  std::optional<std::string> port_file;
  /// Same for the gateway.
  std::optional<std::string> web_port_file;
  /// Only checks whether the server at this address serves.
  std::optional<Address> health_check;
  HealthCheckSecurity health_check_security;
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
};

/// The process prints `text` and exits with `code`.
struct EarlyExit {
  int code = 0;      ///< 0 for --help and --version, 2 for a wrong command line.
  std::string text;  ///< For standard output if `code` is 0, otherwise one line for standard error.
};

std::variant<CommandLine, EarlyExit> ParseCommandLine(int argc, const char* const* argv);

}  // namespace partiemc::server
