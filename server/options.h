// The command line of partiemc-server, its environment variables and its config file.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/rpc/health_check.h"
#include "server/server.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

struct CommandLine {
  ServerOptions server;
  /// Time limit of the drain (Server::Drain), which begins `drain_delay` after SIGTERM or SIGINT.
  std::chrono::milliseconds grace{4000};
  /// Time after SIGTERM or SIGINT in which the server still serves, while its health checks report
  /// that it does not serve (Server::SendAway).
  std::chrono::milliseconds drain_delay{0};
  /// File to which the server writes its bound address when it serves.
  std::optional<std::string> port_file;
  /// File to which the server writes the bound address of the gateway.
  std::optional<std::string> web_port_file;
  /// If set, the program does not serve. It only checks whether the server at this address serves.
  std::optional<Address> health_check;
  HealthCheckSecurity health_check_security;
  std::string log_level = "info";
  LogFormat log_format = LogFormat::kText;
  /// Environment variables PARTIEMC_* that set no option, for a warning (FindUnknownVariables).
  std::vector<std::string> ignored_variables;
};

/// Returned if the process must print `text` and exit with `code`.
struct EarlyExit {
  int code = 0;      ///< 2 for a wrong command line; 0 for --help, --version, --print-memory-plan.
  std::string text;  ///< For standard output if `code` is 0, otherwise one line for standard error.
};

std::variant<CommandLine, EarlyExit> ParseCommandLine(int argc, const char* const* argv);

}  // namespace partiemc::server
