// Finds the files of an input: a file, a directory or a pattern.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// Files whose names differ only in numbers: frames of one recording, in natural order.
struct FileSeries {
  std::string pattern;  ///< "WaterBlock_*.vtp", or the name of the only file.
  std::vector<std::string> files;
  std::size_t bytes = 0;         ///< Total size of the files.
  bool uncertain_order = false;  ///< As SortNaturally returns it.
};

enum class InputKind { kFile, kDirectory, kPattern };

struct InputFiles {
  InputKind kind = InputKind::kFile;
  std::string directory;           ///< Directory of the files; "" is the working directory.
  std::vector<FileSeries> series;  ///< At least one, in natural order of their patterns.
};

/// Lists the files of `input`, without hidden files and folders. In a directory the names of a
/// series differ in one number ("run1_*" and "run2_*" are two series); with a pattern they may
/// differ in several numbers. Errors: kNotFound without a file.
absl::StatusOr<InputFiles> ListInput(const std::string& input);

/// The error for an input with several series. Lists them and suggests the one with most bytes.
absl::Status SeveralSeries(const std::string& input, const InputFiles& files);

}  // namespace partiemc::client::input
