// The secret by which a producer shows that a stream is his.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace partiemc::server {

/// The reason of INVALID_ARGUMENT for a token of another form (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonStreamToken = "STREAM_TOKEN";

/// 128 random bits as 32 hexadecimal digits.
std::string NewStreamToken();

/// Whether `text` could be one. A server takes what another one has given.
bool IsStreamToken(std::string_view text);

/// INVALID_ARGUMENT (STREAM_TOKEN) for what could not be one; never shows it.
absl::Status CheckStreamToken(std::string_view text);

/// What may be told of a token: the same for the same one, on every server; 32 hexadecimal digits
/// from which nobody finds the token.
std::string LineageOf(std::string_view token);

/// In a time that does not tell how much of them is alike, but for their lengths.
bool SameToken(std::string_view a, std::string_view b);

}  // namespace partiemc::server
