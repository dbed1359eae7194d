// The format of secrets in files: bearer tokens and keys.
#pragma once

#include <cstddef>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// Shorter secrets can be guessed.
inline constexpr std::size_t kMinSecretBytes = 16;
inline constexpr std::size_t kMaxSecretBytes = 512;

inline constexpr char kSecretRule[] = "of 16 to 512 characters of [A-Za-z0-9-._~+/=]";

/// Whether `text` conforms to kSecretRule, which is the syntax of a token in `authorization:
/// Bearer` (RFC 6750, 2.1).
bool IsSecret(std::string_view text);

/// Checks that the text of a file of secrets ends with a newline. Without the newline, the last
/// line may be half written: its missing part could restrict the permissions of a token, and a
/// truncated token is easier to guess. Errors: INVALID_ARGUMENT. An empty text is valid here.
absl::Status CheckIsWhole(std::string_view text);

}  // namespace partiemc::server
