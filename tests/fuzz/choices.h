// Reads fuzzed bytes as a list of choices, so that mutations of bytes become mutations of
// structure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "fuzz/targets.h"

namespace partiemc::fuzz {

/// Takes values from the front. After the end every value is zero.
class Choices {
 public:
  explicit Choices(Bytes bytes) : rest_(bytes) {}

  bool empty() const { return rest_.empty(); }

  template <typename T>
  T Take() {
    T value{};
    const std::size_t size = std::min(sizeof(T), rest_.size());
    if (size > 0) std::memcpy(&value, rest_.data(), size);
    rest_ = rest_.subspan(size);
    return value;
  }
  bool Flip() { return Take<std::uint8_t>() & 1; }
  /// In [0, count). Requires: count is at most 256.
  std::size_t Below(std::size_t count) { return Take<std::uint8_t>() % count; }

  /// The next `size` bytes, or fewer at the end.
  std::string_view TakeText(std::size_t size) {
    size = std::min(size, rest_.size());
    const std::string_view text(reinterpret_cast<const char*>(rest_.data()), size);
    rest_ = rest_.subspan(size);
    return text;
  }
  std::string_view TakeRest() { return TakeText(rest_.size()); }
  /// Up to the next byte with this value, which is consumed, or to the end.
  std::string_view TakeUntil(std::uint8_t end) {
    const auto at = std::find(rest_.begin(), rest_.end(), end);
    const std::string_view text = TakeText(static_cast<std::size_t>(at - rest_.begin()));
    if (!rest_.empty()) rest_ = rest_.subspan(1);
    return text;
  }

 private:
  Bytes rest_;
};

}  // namespace partiemc::fuzz
