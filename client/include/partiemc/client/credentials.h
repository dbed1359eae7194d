// How a client makes sure of its server, and the server of its client.
#pragma once

#include <string>

namespace partiemc::client {

/// Files are PEM and are read when a connection is made, a token file at every call: a token that
/// was replaced counts from the next call on.
struct Credentials {
  /// Speak TLS: the server's certificate must be valid, signed by a known authority, and for the
  /// host of the address.
  bool tls = false;
  std::string ca_file = {};  ///< The authorities that are known; empty: those of the system.
  /// The client's own certificate and key, for a server that asks for one. Both or neither.
  std::string cert_file = {};
  std::string key_file = {};

  /// The bearer token that is sent with every call; empty: none. A token is a secret: it is sent
  /// over TLS or within this machine, and refused to go anywhere else.
  std::string token = {};
  /// Or the file that holds it: the first word that is no comment, so that the file of a server
  /// does as well. Counts only without `token`.
  std::string token_file = {};
};

/// What the command line reads, too: PARTIEMC_TLS (0, false, no, off or empty: not),
/// PARTIEMC_TLS_CA, PARTIEMC_TLS_CERT, PARTIEMC_TLS_KEY, PARTIEMC_TOKEN, PARTIEMC_TOKEN_FILE.
/// Whoever names a certificate wants TLS.
Credentials CredentialsFromEnvironment();

/// PARTIEMC_SERVER, or else 127.0.0.1:50051.
std::string ServerFromEnvironment();

}  // namespace partiemc::client
