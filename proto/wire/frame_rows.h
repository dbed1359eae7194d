// The arrays of a frame in the order of its message, for any memory layout of the caller.
#pragma once

#include <cstddef>
#include <cstring>
#include <functional>
#include <string_view>
#include <vector>

#include "partiemc/frame.h"

namespace partiemc::wire {

/// An array of rows, in contiguous memory or written by a function.
struct RowArray {
  std::size_t rows = 0;       ///< 0: no array.
  std::size_t row_bytes = 1;  ///< At most 24.
  /// Writes rows [begin, end) to `to`. Used if `in_place` is null.
  std::function<void(std::size_t begin, std::size_t end, std::byte* to)> write = {};
  /// All rows in the format of the message, contiguous; or null.
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

/// A view of a frame, with its arrays separate from its scalars.
struct FrameRows {
  /// All arrays are empty. `scalars.positions` has the type of the coordinates.
  Frame scalars;
  RowArray positions, ids, volumes, velocities;
  std::vector<AttributeRows> attributes = {};
};

}  // namespace partiemc::wire
