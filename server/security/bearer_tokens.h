// The bearer tokens of a token file.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "server/security/caller_terms.h"

namespace partiemc::server {

/// The accepted tokens. Stores their SHA-256 digests, so that no token stays in memory and the time
/// of a comparison reveals nothing about a token.
class BearerTokens {
 public:
  using Digest = std::array<std::uint8_t, 32>;
  struct Client {
    Digest digest;
    std::shared_ptr<const CallerTerms> terms;
  };

  /// Parses a token file. Each line of `text` is a token (16 to 512 characters of
  /// [A-Za-z0-9-._~+/=]), followed by the words of ParseCallerTerms, separated by blanks. The
  /// default name is "token-LINE"; the default terms permit everything. Empty lines and lines that
  /// begin with '#' are ignored. Errors: INVALID_ARGUMENT for an invalid word, a repeated token, no
  /// token, or more than 1,000 tokens. The message contains line, word number and rule, but not the
  /// word.
  static absl::StatusOr<BearerTokens> Parse(std::string_view text);

  /// Returns the client with this token, or null. Compares the token with all tokens in constant
  /// time.
  const Client* Find(std::string_view token) const { return Find(DigestOf(token)); }

  const std::vector<Client>& clients() const { return clients_; }

 private:
  static Digest DigestOf(std::string_view token);
  const Client* Find(const Digest& digest) const;

  std::vector<Client> clients_;
};

}  // namespace partiemc::server
