#include "server/bearer_tokens.h"

#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <sstream>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

// A token shorter than this can be guessed; a longer one than that is no token.
constexpr std::size_t kMinTokenBytes = 16;
constexpr std::size_t kMaxTokenBytes = 512;
constexpr std::size_t kMaxNameBytes = 64;
// Each call is compared with all of them.
constexpr std::size_t kMaxTokens = 1000;

bool Consists(std::string_view text, std::string_view of) {
  return std::all_of(text.begin(), text.end(), [of](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || of.find(c) != of.npos;
  });
}

bool IsToken(std::string_view text) {
  return text.size() >= kMinTokenBytes && text.size() <= kMaxTokenBytes &&
         Consists(text, "-._~+/=");
}

bool IsName(std::string_view text) { return text.size() <= kMaxNameBytes && Consists(text, "._-"); }

absl::Status Wrong(std::size_t line, const std::string& rule) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ": ", rule));
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
    std::istringstream words(line);
    std::string token, name, more;
    if (!(words >> token) || token.front() == '#') continue;
    words >> name >> more;
    if (!IsToken(token)) {
      return Wrong(number, "must begin with a token of 16 to 512 characters of [A-Za-z0-9-._~+/=]");
    }
    if (!IsName(name) || !more.empty()) {
      return Wrong(number,
                   "after the token may stand one name of at most 64 characters of [A-Za-z0-9._-]");
    }
    const Digest digest = DigestOf(token);
    if (tokens.Find(digest) != nullptr) return Wrong(number, "must not repeat a token");
    if (tokens.size() == kMaxTokens) return Wrong(number, "must be at most 1,000 tokens");
    tokens.clients_.push_back({digest, name.empty() ? absl::StrCat("token-", number) : name});
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

std::optional<std::string> BearerTokens::ClientOf(std::string_view token) const {
  const Client* const client = Find(DigestOf(token));
  if (client == nullptr) return std::nullopt;
  return client->name;
}

}  // namespace partiemc::server
