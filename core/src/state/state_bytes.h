// The bytes that all kinds of states have in common: optional numbers, a box, arrays, a checksum.
// TakeX removes X from the front of `rest`; callers check that the bytes of headers are there. All
// errors are INVALID_ARGUMENT (CORRUPT_STATE).
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "partiemc/parameters.h"
#include "partiemc/status.h"

namespace partiemc {

inline constexpr std::uint64_t kAbsent = 0x7ff8000000000000;  // Not a number.
/// The most in a state. A stream from a forged state can exceed it; its next state is then refused.
inline constexpr std::uint64_t kMaxIdentities = std::uint64_t{1} << 62;
inline constexpr std::size_t kChecksumBytes = 8;
inline constexpr char kAsWritten[] = "must be what Serialize wrote";

inline absl::Status Corrupt(std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state", std::move(value), std::move(rule)});
}

/// Checks that the last 8 bytes are the checksum of all others. Requires: at least 8 bytes.
inline absl::Status CheckSum(std::string_view bytes) {
  const std::string_view body = bytes.substr(0, bytes.size() - kChecksumBytes);
  std::string_view tail = bytes.substr(body.size());
  if (TakeNumber<std::uint64_t>(tail) == ChecksumOf(body)) return absl::OkStatus();
  return Corrupt("a wrong checksum", kAsWritten);
}

inline absl::Status TakeVersion(std::string_view& rest, std::uint32_t expected) {
  const auto version = TakeNumber<std::uint32_t>(rest);
  if (version == expected) return absl::OkStatus();
  return Corrupt(absl::StrCat("version ", version), absl::StrCat("must be version ", expected));
}

inline std::optional<double> TakeOptional(std::string_view& rest) {
  const auto bits = TakeNumber<std::uint64_t>(rest);
  if (bits == kAbsent) return std::nullopt;
  return std::bit_cast<double>(bits);
}

inline void PutOptional(std::optional<double> value, std::string& bytes) {
  PutNumber(value ? std::bit_cast<std::uint64_t>(*value) : kAbsent, bytes);
}

/// Returns whether the version is `with_box`, whose layout has a box after the header.
inline absl::StatusOr<bool> TakeVersion(std::string_view& rest, std::uint32_t without_box,
                                        std::uint32_t with_box) {
  const auto version = TakeNumber<std::uint32_t>(rest);
  if (version == without_box || version == with_box) return version == with_box;
  return Corrupt(absl::StrCat("version ", version),
                 absl::StrCat("must be version ", without_box, " or ", with_box));
}

/// A box is the origin and the length of each axis; both are kAbsent if the axis is not periodic.
inline constexpr std::size_t kBoxBytes = 6 * 8;

inline std::size_t BoxBytes(const std::optional<PeriodicBox>& box) { return box ? kBoxBytes : 0; }

inline void PutBox(const std::optional<PeriodicBox>& box, std::string& bytes) {
  if (!box) return;
  for (const std::optional<PeriodicAxis>& axis : box->axes) {
    PutOptional(axis ? std::optional(axis->origin) : std::nullopt, bytes);
    PutOptional(axis ? std::optional(axis->length) : std::nullopt, bytes);
  }
}

/// Reads and checks a box if `is_present`; else leaves `box` as it is.
inline absl::Status TakeBox(bool is_present, std::string_view& rest,
                            std::optional<PeriodicBox>& box) {
  if (!is_present) return absl::OkStatus();
  if (rest.size() < kBoxBytes) return Corrupt("a box cut off", kAsWritten);
  box.emplace();
  bool any = false;
  for (std::optional<PeriodicAxis>& axis : box->axes) {
    const auto origin = TakeOptional(rest), length = TakeOptional(rest);
    if (!origin && !length) continue;
    any = true;
    axis = PeriodicAxis{origin.value_or(0), length.value_or(0)};
    if (!origin || !std::isfinite(axis->origin) || !std::isfinite(axis->length) ||
        !(axis->length > 0)) {
      return Corrupt("a box", "must have finite axes of positive length");
    }
  }
  if (!any) return Corrupt("a box", "must have an axis");
  return absl::OkStatus();
}

/// Reads a number, or a bool from a number of 4 bytes. Returns false if that is neither 0 nor 1.
template <typename Number>
bool TakeNumberOrFlag(std::string_view& rest, Number& number) {
  if constexpr (std::is_same_v<Number, bool>) {
    const auto flag = TakeNumber<std::uint32_t>(rest);
    number = flag == 1;
    return flag <= 1;
  } else {
    number = TakeNumber<Number>(rest);
    return true;
  }
}

void PutNumberOrFlag(auto number, std::string& bytes) {
  if constexpr (std::is_same_v<decltype(number), bool>) {
    PutNumber(std::uint32_t{number}, bytes);
  } else {
    PutNumber(number, bytes);
  }
}

/// An array of a state: its name in messages, and the bytes of one element.
struct ArrayKind {
  const char* name;
  std::size_t bytes;
};

template <std::size_t kKinds>
std::uint64_t BytesOf(const std::array<ArrayKind, kKinds>& kinds,
                      const std::array<std::uint64_t, kKinds>& counts) {
  std::uint64_t bytes = 0;
  for (std::size_t k = 0; k < kKinds; ++k) bytes += counts[k] * kinds[k].bytes;
  return bytes;
}

/// Reads the sizes of the arrays, and checks that the arrays fill the rest of the bytes. Each size
/// is bounded before it is multiplied, so that nothing overflows.
template <std::size_t kKinds>
absl::StatusOr<std::array<std::uint64_t, kKinds>> TakeCounts(
    const std::array<ArrayKind, kKinds>& kinds, std::string_view& rest) {
  std::array<std::uint64_t, kKinds> counts;
  for (std::uint64_t& count : counts) count = TakeNumber<std::uint64_t>(rest);
  bool is_possible = true;
  for (std::size_t k = 0; k < kKinds; ++k) {
    is_possible = is_possible && counts[k] <= rest.size() / kinds[k].bytes;
  }
  if (is_possible && BytesOf(kinds, counts) == rest.size()) return counts;
  std::string value = absl::StrCat(rest.size(), " bytes"), rule = "must consist of";
  for (std::size_t k = 0; k < kKinds; ++k) {
    absl::StrAppend(&value, k == 0 ? " for " : ", ", counts[k], " ", kinds[k].name);
    absl::StrAppend(&rule, k == 0 ? " " : ", ", kinds[k].name, " of ", kinds[k].bytes);
  }
  return Corrupt(std::move(value), absl::StrCat(rule, " bytes"));
}

/// Appends the elements of a tuple of arrays. numbers_of(element) returns the element's members as
/// a tuple of references, in the order of the layout.
template <typename Arrays, typename NumbersOf>
void PutArrays(const Arrays& arrays, NumbersOf numbers_of, std::string& bytes) {
  const auto put = [&](const auto&... number) { (PutNumberOrFlag(number, bytes), ...); };
  const auto put_all = [&](const auto& array) {
    for (const auto& item : array) std::apply(put, numbers_of(item));
  };
  std::apply([&](const auto&... array) { (put_all(array), ...); }, arrays);
}

/// Reads the arrays that PutArrays wrote. Returns false if a bool is neither 0 nor 1. Requires: the
/// bytes of the arrays, which TakeCounts checks.
template <typename Arrays, std::size_t kKinds, typename NumbersOf>
bool TakeArrays(const std::array<std::uint64_t, kKinds>& counts, NumbersOf numbers_of,
                std::string_view& rest, Arrays arrays) {
  bool has_flags = true;
  const auto take = [&](auto&... number) { ((has_flags &= TakeNumberOrFlag(rest, number)), ...); };
  std::size_t kind = 0;
  const auto take_all = [&](auto& array) {
    array.resize(counts[kind++]);
    for (auto& item : array) std::apply(take, numbers_of(item));
  };
  std::apply([&](auto&... array) { (take_all(array), ...); }, arrays);
  return has_flags;
}

}  // namespace partiemc
