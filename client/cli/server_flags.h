// The flags of every verb that connects to a server: address, TLS and token.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "partiemc/client/credentials.h"
#include "partiemc/client/stream.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace partiemc::client {

struct ServerFlags {
  std::string address = ServerFromEnvironment();
  Credentials credentials;
};

/// Adds --server, --tls, --tls-ca, --tls-cert, --tls-key and --token-file. Returns --server.
/// Requires: `flags` outlives the parsing. No flag holds the token itself, because every user of
/// the machine can read a command line. The environment variable PARTIEMC_TOKEN holds it.
CLI::Option* AddServerFlags(CLI::App& app, ServerFlags& flags, const std::string& group);

/// Adds --coordinates: float64, float32 or compact.
CLI::Option* AddCoordinatesFlag(CLI::App& app, std::string& coordinates);
Coordinates CoordinatesOf(std::string_view name);

/// The flags of a verb that sends one request and prints the response.
struct QueryFlags {
  ServerFlags server;
  double deadline_seconds = 5;
  bool json = false;

  std::chrono::milliseconds Deadline() const;
};

/// Adds the flags of AddServerFlags, --deadline and --json.
void AddQueryFlags(CLI::App& app, QueryFlags& flags);

}  // namespace partiemc::client
