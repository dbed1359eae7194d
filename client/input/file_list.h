// From what a person names to the files that are meant.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// Files whose names differ only in a number: frames of one recording, in natural order.
struct FileSeries {
  std::string pattern;  ///< "WaterBlock_*.vtp", or the name of the only file.
  std::vector<std::string> files;
  std::size_t bytes = 0;  ///< Of all files together.
};

enum class InputKind { kFile, kDirectory, kPattern };

struct InputFiles {
  InputKind kind = InputKind::kFile;
  std::string directory;           ///< Where the files are, "" for the working directory.
  std::vector<FileSeries> series;  ///< At least one, in natural order of their patterns.
};

/// Lists what `input` names; hidden files and folders within a directory are left out. In a
/// directory a series is what differs in one number ("run1_*" and "run2_*" are two), in a pattern
/// what differs in numbers only: who writes a pattern has chosen.
/// Errors: kNotFound if there is no such file or nothing in the directory.
absl::StatusOr<InputFiles> ListInput(const std::string& input);

/// The refusal of an input that holds several series: names them and proposes the largest.
absl::Status SeveralSeries(const std::string& input, const InputFiles& files);

}  // namespace partiemc::client::input
