#include "client/cli/server_flags.h"

#include <cstdlib>

#include "CLI/CLI.hpp"

namespace partiemc::client {

CLI::Option* AddServerFlags(CLI::App& app, ServerFlags& flags, const std::string& group) {
  Credentials& credentials = flags.credentials;
  CLI::Option* server =
      app.add_option("--server", flags.address,
                     "Server: HOST:PORT or unix:PATH; PARTIEMC_SERVER names another default")
          ->type_name("ADDRESS")
          ->capture_default_str()
          ->group(group);
  app.add_flag("--tls", credentials.tls,
               "Speak TLS, and only to a server whose certificate is for that host")
      ->envname("PARTIEMC_TLS")
      ->group(group);
  // Whoever names a certificate wants TLS.
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
           "TLS; authorities that may have signed the server's certificate (PEM), instead of the "
           "system's",
           "PARTIEMC_TLS_CA");
  CLI::Option* certificate =
      add_file("--tls-cert", credentials.cert_file,
               "TLS; own certificate (PEM), for a server that asks for one", "PARTIEMC_TLS_CERT");
  CLI::Option* key =
      add_file("--tls-key", credentials.key_file, "Its private key (PEM)", "PARTIEMC_TLS_KEY");
  certificate->needs(key);
  key->needs(certificate);
  app.add_option("--token-file", credentials.token_file,
                 "File with the bearer token for the server; or the token itself in PARTIEMC_TOKEN")
      ->type_name("FILE")
      ->envname("PARTIEMC_TOKEN_FILE")
      ->group(group);
  if (const char* token = std::getenv("PARTIEMC_TOKEN")) credentials.token = token;
  return server;
}

std::chrono::milliseconds ToMilliseconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::duration<double>(seconds));
}

std::chrono::milliseconds QueryFlags::Deadline() const { return ToMilliseconds(deadline_seconds); }

void AddQueryFlags(CLI::App& app, QueryFlags& flags) {
  AddServerFlags(app, flags.server, "Server");
  app.add_option("--deadline", flags.deadline_seconds, "Seconds that the answer may take")
      ->check(CLI::Range(0.001, 86400.0))
      ->capture_default_str();
  app.add_flag("--json", flags.json, "One JSON object on one line");
}

}  // namespace partiemc::client
