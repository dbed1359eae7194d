// Reads arrays of numpy.save.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

/// The header of an array of numbers.
struct NpyHeader {
  ElementType type = ElementType::kFloat64;
  bool swapped = false;       ///< Byte order other than this machine's.
  bool column_major = false;  ///< Fortran order.
  std::vector<std::size_t> shape;

  std::size_t element_count() const;  ///< Does not overflow: ReadNpyHeader has checked.
};

/// Reads the header. `name` is for messages. Errors: kDataLoss for an invalid header or a size
/// over 4 GiB; kUnimplemented for elements that are not plain numbers (Python objects, structures,
/// complex, half precision).
absl::StatusOr<NpyHeader> ReadNpyHeader(ByteSource& source, const std::string& name);

/// Reads the elements that follow the header. kDataLoss if `source` holds fewer or more bytes.
absl::Status ReadNpyElements(ByteSource& source, const NpyHeader& header, const std::string& name,
                             std::vector<char>& bytes);

/// Columns of an array of shape (N,) or (N, K): views into `bytes`.
std::vector<ArrayColumn> NpyColumns(const NpyHeader& header, const std::vector<char>& bytes);

}  // namespace partiemc::client::input
