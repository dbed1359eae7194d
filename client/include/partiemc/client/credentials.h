// TLS and token settings with which client and server authenticate each other.
#pragma once

#include <string>

namespace partiemc::client {

/// All files are PEM except the token file. PEM files are read when a connection is opened. The
/// token file is read at every call, so a new token applies from the next call.
struct Credentials {
  /// Uses TLS. The server's certificate must be valid, signed by a known authority, and issued for
  /// the host of the address.
  bool tls = false;
  std::string ca_file = {};  ///< Trusted authorities; empty: the system's.
  /// The client's certificate and private key, if the server requires a certificate. Set both or
  /// neither.
  std::string cert_file = {};
  std::string key_file = {};

  /// Bearer token sent with every call; empty: none. It is sent only over TLS or within this
  /// machine. Opening a connection to any other address fails (INVALID_ARGUMENT).
  std::string token = {};
  /// File with the token; ignored if `token` is set. Its first word outside of # comments is the
  /// token, so a server's token file works too.
  std::string token_file = {};
};

/// Reads PARTIEMC_TLS (empty, 0, false, f, no, n, off or disable: disabled), PARTIEMC_TLS_CA,
/// PARTIEMC_TLS_CERT, PARTIEMC_TLS_KEY, PARTIEMC_TOKEN and PARTIEMC_TOKEN_FILE, like the command
/// line. Each of the three files enables TLS.
Credentials CredentialsFromEnvironment();

/// The value of PARTIEMC_SERVER; 127.0.0.1:50051 if it is not set.
std::string ServerFromEnvironment();

}  // namespace partiemc::client
