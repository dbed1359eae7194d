#include "server/security/checkpoint_keys.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "server/security/secrets.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kMaxKeys = 2;  // The current key, and its predecessor or successor.

using Signature = std::array<unsigned char, CheckpointKeys::kSignatureBytes>;

Signature SignatureOf(std::string_view bytes, const std::string& key) {
  Signature signature;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
       reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), signature.data(),
       nullptr);
  return signature;
}

absl::Status Wrong(std::size_t line, const std::string& rule) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ": ", rule));
}

}  // namespace

absl::StatusOr<CheckpointKeys> CheckpointKeys::Parse(std::string_view text) {
  CheckpointKeys keys;
  std::istringstream lines{std::string(text)};
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    std::string key, more;
    if (!(words >> key) || key.front() == '#') continue;
    if (!IsSecret(key) || words >> more) {
      return Wrong(number, absl::StrCat("must be a key ", kSecretRule));
    }
    if (std::ranges::count(keys.keys_, key) > 0) return Wrong(number, "must not repeat a key");
    if (keys.keys_.size() == kMaxKeys) {
      return Wrong(number, "must be at most two keys: the one that signs, then one that verifies");
    }
    keys.keys_.push_back(std::move(key));
  }
  if (keys.keys_.empty()) return absl::InvalidArgumentError("no key; must have one or two lines");
  return keys;
}

std::string CheckpointKeys::Sign(std::string_view bytes) const {
  const Signature signature = SignatureOf(bytes, keys_.front());
  return {signature.begin(), signature.end()};
}

bool CheckpointKeys::Verify(std::string_view bytes, std::string_view signature) const {
  if (signature.size() != kSignatureBytes) return false;
  bool verified = false;
  for (const std::string& key : keys_) {  // Constant time: always tries all keys.
    const Signature expected = SignatureOf(bytes, key);
    const bool same = CRYPTO_memcmp(expected.data(), signature.data(), kSignatureBytes) == 0;
    verified = verified || same;
  }
  return verified;
}

void CurrentCheckpointKeys::Set(CheckpointKeys keys) {
  auto next = std::make_shared<const CheckpointKeys>(std::move(keys));
  const MutexLock lock(mutex_);
  keys_ = std::move(next);
}

std::shared_ptr<const CheckpointKeys> CurrentCheckpointKeys::Get() const {
  const MutexLock lock(mutex_);
  return keys_;
}

}  // namespace partiemc::server
