// A server whose certificate, authority and tokens are files that a test writes, and clients that
// bring along what they like.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "service/service_testing.h"
#include "support/certificates.h"
#include "support/temporary_folder.h"

namespace partiemc::server {

inline constexpr char kToken[] = "alice-secret-0123456789";
inline constexpr char kOtherToken[] = "bob-secret-0123456789ab";

// What a client brings along.
struct Client {
  bool tls = true;
  std::string authority;  // That it trusts.
  IssuedCertificate own = {};
  std::string token = {};
};

class Security : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return folder_.Path(name); }
  // As a careful operator does it: whole or not at all.
  void Write(const std::string& name, const std::string& text) const;
  void WriteIdentity(const IssuedCertificate& identity) const;

  ServerOptions Options(bool tls, bool client_ca, bool tokens) const;

  // A connection of its own.
  std::shared_ptr<grpc::Channel> Channel(const Client& client) const;

  struct End {
    grpc::StatusCode code;
    std::string reason, message;
  };
  // How a call of GetServerInfo ends.
  End Ask(const Client& client) const { return Ask(Channel(client), client.token); }
  static End Ask(const std::shared_ptr<grpc::Channel>& channel, const std::string& token);
  // How a call of any method ends that sends one empty message; streams are told after it that no
  // more will come.
  static End Call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                  const std::string& authorization);

  const support::TemporaryFolder folder_;  // Goes after the server that looks into it.
  CertificateAuthority authority_{"authority"}, stranger_{"stranger"};
  std::unique_ptr<Server> server_;
};

}  // namespace partiemc::server
