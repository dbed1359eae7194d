// The tokens that clients may identify themselves with, as a file lists them.
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

/// Holds digests (SHA-256), so that no token stays in memory and comparing tells nothing by its
/// time.
class BearerTokens {
 public:
  using Digest = std::array<std::uint8_t, 32>;
  struct Client {
    Digest digest;
    std::shared_ptr<const CallerTerms> terms;
  };

  /// `text` has a token a line, and after it, with blanks between them, the words of
  /// ParseCallerTerms: without a name the client's is "token-LINE", without anything else it may
  /// everything. Blank lines and lines that begin with '#' count for nothing. A token is 16 to 512
  /// characters of [A-Za-z0-9-._~+/=].
  /// Errors: INVALID_ARGUMENT, which tells line, word and rule and shows no word: one that is not
  /// as said, a token twice, no token at all, more than 1,000.
  static absl::StatusOr<BearerTokens> Parse(std::string_view text);

  /// The client that has this token; null if there is none. Takes as long for every token of the
  /// same length: all are compared with, to their last byte.
  const Client* Find(std::string_view token) const { return Find(DigestOf(token)); }

  const std::vector<Client>& clients() const { return clients_; }

 private:
  static Digest DigestOf(std::string_view token);
  const Client* Find(const Digest& digest) const;

  std::vector<Client> clients_;
};

}  // namespace partiemc::server
