#include "server/security/bearer_tokens.h"

#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/security/secrets.h"

namespace partiemc::server {
namespace {

// Limits the time of Find, which compares the token of each call with all tokens.
constexpr std::size_t kMaxTokens = 1000;

absl::Status Wrong(std::size_t line, const std::string& rule) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ", ", rule));
}

}  // namespace

BearerTokens::Digest BearerTokens::DigestOf(std::string_view token) {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest.data());
  return digest;
}

absl::StatusOr<BearerTokens> BearerTokens::Parse(std::string_view text) {
  BearerTokens tokens;
  std::istringstream lines{std::string(text)};
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream split(line);
    const std::vector<std::string> words(std::istream_iterator<std::string>(split), {});
    if (words.empty() || words[0].front() == '#') continue;
    if (!IsSecret(words[0])) {
      return Wrong(number, absl::StrCat("word 1: must be a token ", kSecretRule));
    }
    const Digest digest = DigestOf(words[0]);
    if (tokens.Find(digest) != nullptr) return Wrong(number, "word 1: must not repeat a token");
    if (tokens.clients_.size() == kMaxTokens) {
      return Wrong(number, "word 1: must be at most 1,000 tokens");
    }
    auto terms = ParseCallerTerms(std::span(words).subspan(1));
    if (!terms.ok()) return Wrong(number, std::string(terms.status().message()));
    if (terms->name.empty()) terms->name = absl::StrCat("token-", number);
    tokens.clients_.push_back({digest, std::make_shared<const CallerTerms>(*std::move(terms))});
  }
  if (tokens.clients_.empty()) {
    return absl::InvalidArgumentError("no token; must have one a line");
  }
  return tokens;
}

const BearerTokens::Client* BearerTokens::Find(const Digest& digest) const {
  const Client* found = nullptr;
  for (const Client& client : clients_) {
    const bool same = CRYPTO_memcmp(client.digest.data(), digest.data(), digest.size()) == 0;
    found = same ? &client : found;
  }
  return found;
}

}  // namespace partiemc::server
