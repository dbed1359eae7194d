// Arrays as numpy.save writes them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

/// What the header of an array says. Its elements are numbers.
struct NpyHeader {
  ElementType type = ElementType::kFloat64;
  bool swapped = false;       ///< Byte order other than this machine's.
  bool column_major = false;  ///< Fortran order.
  std::vector<std::size_t> shape;

  std::size_t element_count() const;  ///< Does not overflow: ReadNpyHeader has checked.
};

/// Reads the header. `name` is for messages. Errors: kDataLoss if it is none; kUnimplemented if the
/// elements are not plain numbers (Python objects, structures, complex, half precision); sizes over
/// 4 GiB are kDataLoss.
absl::StatusOr<NpyHeader> ReadNpyHeader(ByteSource& source, const std::string& name);

/// Reads the elements that follow the header. kDataLoss if `source` holds fewer or more bytes.
absl::Status ReadNpyElements(ByteSource& source, const NpyHeader& header, const std::string& name,
                             std::vector<char>& bytes);

/// Columns of an array of shape (N,) or (N, K): views into `bytes`.
std::vector<ArrayColumn> NpyColumns(const NpyHeader& header, const std::vector<char>& bytes);

}  // namespace partiemc::client::input
