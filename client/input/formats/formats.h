// Which format a file has, by its content first and its name second.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {

struct Format {
  std::string_view name;  ///< "CSV", for descriptions.
  OpenReader* open;
  bool one_frame_per_file;
};

/// Looks at the name and the first bytes of a file. Errors: kUnimplemented, with a word on what the
/// file is and what to do, for formats that are not read; kDataLoss for an empty file; those of
/// OpenFile.
absl::StatusOr<const Format*> RecogniseFormat(const std::string& path);

}  // namespace partiemc::client::input
