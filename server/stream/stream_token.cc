#include "server/stream/stream_token.h"

#include <openssl/crypto.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

constexpr std::size_t kDigits = 32;

}  // namespace

std::string NewStreamToken() {
  std::random_device random;  // The operating system's generator.
  std::string token;
  while (token.size() < kDigits) absl::StrAppend(&token, absl::Hex(random(), absl::kZeroPad8));
  return token;
}

bool IsStreamToken(std::string_view text) {
  return text.size() == kDigits && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f');
         });
}

absl::Status CheckStreamToken(std::string_view text) {
  if (IsStreamToken(text)) return absl::OkStatus();
  // Without the text, which may be another secret that the client has sent by mistake.
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonStreamToken), "open.resume.stream_token",
       absl::StrCat(text.size(), " characters"), "must be the stream_token of StreamOpened"});
}

std::string LineageOf(std::string_view token) {
  const std::string text = "lineage of " + std::string(token);
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest;
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(digest.data()), kDigits / 2));
}

bool SameToken(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace partiemc::server
