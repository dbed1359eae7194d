// The arrays of a frame, wherever they come from, as its message holds them.
#pragma once

#include <cstddef>
#include <cstring>
#include <functional>
#include <string_view>
#include <vector>

#include "partiemc/frame.h"

namespace partiemc::wire {

/// An array of rows, which somebody else writes.
struct RowArray {
  std::size_t rows = 0;       ///< 0: none.
  std::size_t row_bytes = 1;  ///< At most 24.
  /// Writes rows [begin, end) to memory that has room for them. Without `in_place` only.
  std::function<void(std::size_t begin, std::size_t end, std::byte* to)> write = {};
  /// Where all rows lie one after the other as the message has them, if they do.
  const std::byte* in_place = nullptr;

  std::size_t bytes() const { return rows * row_bytes; }
  void WriteAll(std::byte* to) const {
    if (in_place != nullptr && rows > 0) std::memcpy(to, in_place, bytes());
    if (in_place == nullptr && rows > 0) write(0, rows, to);
  }
};

/// One of Frame::attributes.
struct AttributeRows {
  std::string_view name;
  int components = 1;
  RowArray values;
};

/// A frame without its arrays, and them. A view.
struct FrameRows {
  /// `positions` is empty and tells the type of coordinates; there are no attributes.
  Frame scalars;
  RowArray positions, ids, volumes, velocities;
  std::vector<AttributeRows> attributes = {};
};

}  // namespace partiemc::wire
