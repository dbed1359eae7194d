// Parses numbers in files, independent of the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace partiemc::client::input {

/// A decimal number: "1", "+.5", "-1.25e-3", "nan", "inf". All of `text` must be the number.
/// Overflow gives infinity, underflow zero, like strtod.
std::optional<double> ParseNumber(std::string_view text);

/// A count or an index: digits only, below 2^64.
std::optional<std::uint64_t> ParseCount(std::string_view text);

/// Parses an identity: a count, or a floating-point number that is an integer below 2^53
/// ("3.000e+00", as NumPy's savetxt writes it).
std::optional<std::uint64_t> ParseId(std::string_view text);

/// The identity that `number` stands for; absent unless it is an integer in [0, 2^53).
std::optional<std::uint64_t> IdOfNumber(double number);

}  // namespace partiemc::client::input
