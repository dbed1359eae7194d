// The stream token: the secret that allows a producer to resume a stream.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// The violation's reason if a stream token has the wrong format (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonStreamToken = "STREAM_TOKEN";

/// Returns a new token: 128 random bits as 32 hexadecimal digits.
std::string NewStreamToken();

/// Whether `text` has the format of a stream token. The token may come from another server.
bool IsStreamToken(std::string_view text);

/// Returns INVALID_ARGUMENT (STREAM_TOKEN) if `text` does not have the format of a token. The error
/// does not contain `text`.
absl::Status CheckStreamToken(std::string_view text);

/// A public identifier of the stream with this token, the same on every server: 32 hexadecimal
/// digits of the token's SHA-256. The token cannot be computed from it.
std::string LineageOf(std::string_view token);

/// Compares two tokens in a time that depends only on their lengths, so that timing does not reveal
/// a token.
bool SameToken(std::string_view a, std::string_view b);

}  // namespace partiemc::server
