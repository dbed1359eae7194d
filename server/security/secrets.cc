#include "server/security/secrets.h"

#include <algorithm>

#include "absl/strings/ascii.h"

namespace partiemc::server {

bool IsSecret(std::string_view text) {
  constexpr std::string_view kOthers = "-._~+/=";
  return text.size() >= kMinSecretBytes && text.size() <= kMaxSecretBytes &&
         std::ranges::all_of(text, [kOthers](char c) {
           return absl::ascii_isalnum(static_cast<unsigned char>(c)) ||
                  kOthers.find(c) != kOthers.npos;
         });
}

absl::Status CheckIsWhole(std::string_view text) {
  if (text.empty() || text.back() == '\n') return absl::OkStatus();
  return absl::InvalidArgumentError(
      "the last line may be half written; must end with a newline: add one, or replace the file by "
      "a rename");
}

}  // namespace partiemc::server
