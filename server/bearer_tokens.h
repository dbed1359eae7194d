// The tokens that clients may identify themselves with, as a file lists them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace partiemc::server {

/// Holds digests (SHA-256), so that no token stays in memory and comparing tells nothing by its
/// time.
class BearerTokens {
 public:
  /// `text` has a token a line, and after blanks the name of its client for the log (without one:
  /// "token-LINE"); blank lines and lines that begin with '#' count for nothing. A token is 16 to
  /// 512 characters of [A-Za-z0-9-._~+/=], a name 1 to 64 of [A-Za-z0-9._-].
  /// Errors: INVALID_ARGUMENT, which names the line and the rule and never a token: something that
  /// is neither, a token twice, no token at all, more than 1,000.
  static absl::StatusOr<BearerTokens> Parse(std::string_view text);

  /// The client that has this token, if any. Takes as long for every token of the same length: all
  /// are compared with, to their last byte.
  std::optional<std::string> ClientOf(std::string_view token) const;

  std::size_t size() const { return clients_.size(); }

 private:
  using Digest = std::array<std::uint8_t, 32>;
  struct Client {
    Digest digest;
    std::string name;
  };
  static Digest DigestOf(std::string_view token);
  const Client* Find(const Digest& digest) const;

  std::vector<Client> clients_;
};

}  // namespace partiemc::server
