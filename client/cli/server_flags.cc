#include "client/cli/server_flags.h"

#include <cstdlib>

#include "CLI/CLI.hpp"
#include "client/library/adapters/seconds.h"
#include "partiemc/client/parameter_names.h"

namespace partiemc::client {

CLI::Option* AddServerFlags(CLI::App& app, ServerFlags& flags, const std::string& group) {
  Credentials& credentials = flags.credentials;
  CLI::Option* server =
      app.add_option("--server", flags.address,
                     "Server address, HOST:PORT or unix:PATH. PARTIEMC_SERVER sets another default")
          ->type_name("ADDRESS")
          ->capture_default_str()
          ->group(group);
  app.add_flag("--tls", credentials.tls,
               "Use TLS and require a certificate for the host of the address")
      ->envname("PARTIEMC_TLS")
      ->group(group);
  const auto add_file = [&](const char* name, std::string& file, const char* what,
                            const char* variable) {
    return app
        .add_option_function<std::string>(
            name,
            [&](const std::string& path) {
              file = path;
              credentials.tls = true;
            },
            what)
        ->type_name("FILE")
        ->envname(variable)
        ->group(group);
  };
  add_file("--tls-ca", credentials.ca_file,
           "Certificate authorities (PEM) to trust instead of the system's; enables TLS",
           "PARTIEMC_TLS_CA");
  CLI::Option* certificate = add_file(
      "--tls-cert", credentials.cert_file,
      "Client certificate (PEM), for servers that require one; enables TLS", "PARTIEMC_TLS_CERT");
  CLI::Option* key = add_file("--tls-key", credentials.key_file, "Private key of --tls-cert (PEM)",
                              "PARTIEMC_TLS_KEY");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--token-file", credentials.token_file,
                 "File with the bearer token. PARTIEMC_TOKEN holds the token itself")
      ->type_name("FILE")
      ->envname("PARTIEMC_TOKEN_FILE")
      ->group(group);
  if (const char* token = std::getenv("PARTIEMC_TOKEN")) credentials.token = token;
  return server;
}

CLI::Option* AddCoordinatesFlag(CLI::App& app, std::string& coordinates) {
  return app
      .add_option("--coordinates", coordinates,
                  "How the server sends coordinates: float64 (exact), float32 (half the bytes) or "
                  "compact (surfaces in about 5 bytes per triangle, within .001 spacings)")
      ->check(CLI::IsMember({"float64", "float32", "compact"}))
      ->type_name("FORMAT")
      ->capture_default_str();
}

Coordinates CoordinatesOf(std::string_view name) {
  Coordinates coordinates = Coordinates::kFloat64;
  SetByName(name, coordinates).IgnoreError();  // The flag admits only valid names.
  return coordinates;
}

std::chrono::milliseconds QueryFlags::Deadline() const { return ToMilliseconds(deadline_seconds); }

void AddQueryFlags(CLI::App& app, QueryFlags& flags) {
  AddServerFlags(app, flags.server, "Server");
  app.add_option("--deadline", flags.deadline_seconds, "Timeout of the response, in seconds")
      ->check(CLI::Range(0.001, 86400.0))
      ->capture_default_str();
  app.add_flag("--json", flags.json, "Print one JSON object on one line");
}

}  // namespace partiemc::client
