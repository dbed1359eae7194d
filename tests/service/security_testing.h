// A server with certificate, authority and tokens in files that a test writes, and clients with any
// credentials.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "service/service_testing.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::server {

inline constexpr char kToken[] = "alice-secret-0123456789";
inline constexpr std::chrono::seconds kHealthTimeout{30};
inline constexpr char kOtherToken[] = "bob-secret-0123456789ab";

// Credentials of a client.
struct Client {
  bool tls = true;
  std::string authority;  // The authority that it trusts.
  IssuedCertificate own = {};
  std::string token = {};
};

class Security : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.Path(name); }
  // Replaces the file atomically.
  void Write(const std::string& name, const std::string& text) const;
  // Writes a token file of one line.
  void WriteTokens(const std::string& line) const { Write("tokens", line + "\n"); }
  void WriteIdentity(const IssuedCertificate& identity) const;

  ServerOptions Options(bool tls, bool client_ca, bool tokens) const;

  // A channel with its own connection.
  std::shared_ptr<grpc::Channel> Channel(const Client& client) const;

  struct End {
    grpc::StatusCode code;
    std::string reason, message;
  };
  // The end of a GetServerInfo call.
  End Ask(const Client& client) const { return Ask(Channel(client), client.token); }
  static End Ask(const std::shared_ptr<grpc::Channel>& channel, const std::string& token);
  // The end of a call of any method with one empty message. Streams are then half-closed.
  static End Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                  const std::string& authorization);

  const support::TemporaryFolder folder_;  // Destroyed after the server that reads it.
  CertificateAuthority authority_{"authority"}, stranger_{"stranger"};
  std::unique_ptr<Server> server_;
};

}  // namespace partiemc::server
