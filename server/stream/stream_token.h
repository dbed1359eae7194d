// The stream token: the secret that allows a producer to resume a stream.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// The violation's reason if a token has the wrong form (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonStreamToken = "STREAM_TOKEN";

/// 128 random bits as 32 hexadecimal digits.
std::string NewStreamToken();

/// Whether `text` has the form of a token. Any server may have made it.
bool IsStreamToken(std::string_view text);

/// INVALID_ARGUMENT (STREAM_TOKEN) if `text` does not have the form of a token. The error does not
/// contain `text`.
absl::Status CheckStreamToken(std::string_view text);

/// A public identifier of the token's stream, the same on every server: 32 hexadecimal digits of a
/// SHA-256, from which the token cannot be computed.
std::string LineageOf(std::string_view token);

/// Compares in a time that depends only on the lengths, so that timing does not reveal the token.
bool SameToken(std::string_view a, std::string_view b);

}  // namespace partiemc::server
