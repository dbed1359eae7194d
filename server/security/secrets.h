// What a secret in a file may look like: a bearer token's or a key's.
#pragma once

#include <cstddef>
#include <string_view>

namespace partiemc::server {

/// A shorter one can be guessed; a longer one is none.
inline constexpr std::size_t kMinSecretBytes = 16;
inline constexpr std::size_t kMaxSecretBytes = 512;

inline constexpr char kSecretRule[] = "of 16 to 512 characters of [A-Za-z0-9-._~+/=]";

/// Whether it is as kSecretRule says, which is what `authorization: Bearer` takes (RFC 6750, 2.1).
bool IsSecret(std::string_view text);

}  // namespace partiemc::server
