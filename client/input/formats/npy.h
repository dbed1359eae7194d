// Reads arrays of numpy.save.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/array_table.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

/// A field of a structured array. A plain array has one field without a name.
struct NpyField {
  std::string name;
  ElementType type = ElementType::kFloat64;
  bool swapped = false;  ///< Byte order other than this machine's.
  std::size_t components = 1;
  std::size_t offset = 0;  ///< In bytes, from the beginning of an element.
};

/// The header of an array of numbers.
struct NpyHeader {
  bool structured = false;
  std::vector<NpyField> fields;  ///< Without fields that hold no numbers.
  std::size_t element_bytes = 0;
  bool column_major = false;  ///< Fortran order.
  std::vector<std::size_t> shape;

  std::size_t element_count() const;  ///< Does not overflow: ReadNpyHeader has checked.

  /// Whether the first extent counts frames: (frames, N) if structured, else (frames, N, K).
  bool holds_frames() const { return shape.size() == (structured ? 2 : 3); }
};

/// Reads the header. `name` is for messages. Errors: kDataLoss for an invalid header or a frame of
/// over 4 GiB; kUnimplemented for elements without plain numbers (Python objects, text, complex,
/// half precision), and for structured arrays with nested, titled or object fields.
absl::StatusOr<NpyHeader> ReadNpyHeader(ByteSource& source, const std::string& name);

/// Reads the header, the text of a Python dict, and stops before the elements. Errors: kDataLoss.
absl::Status ReadNpyHeaderText(ByteSource& source, const std::string& name,
                               std::vector<char>& bytes);

/// Reads the elements that follow the header. kDataLoss if `source` holds fewer or more bytes.
absl::Status ReadNpyElements(ByteSource& source, const NpyHeader& header, const std::string& name,
                             std::vector<char>& bytes);

/// Reads exactly `size` bytes. kDataLoss if `source` holds fewer.
absl::Status ReadNpyBytes(ByteSource& source, std::size_t size, const std::string& name,
                          std::vector<char>& bytes);

/// Returns a table of an array of shape (N,) or (N, K). The table is a view into `bytes`. Columns
/// of a structured array have the names of its fields. Other columns have the name `name`, or
/// `name`:0, `name`:1, ...
ArrayTable NpyTable(const NpyHeader& header, const std::string& name,
                    const std::vector<char>& bytes);

}  // namespace partiemc::client::input
