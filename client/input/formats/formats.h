// Recognises the format of a file, by its content and then by its name.
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

/// Recognises a format by the first bytes and the name of a file. Errors: kUnimplemented for an
/// unsupported format, with its name and a remedy; kDataLoss for an empty file; the errors of
/// OpenFile.
absl::StatusOr<const Format*> RecogniseFormat(const std::string& path);

}  // namespace partiemc::client::input
