// Files that are there as a whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::client {

/// A file that is written under a hidden temporary name beside its place and moved there by
/// Commit. Until then an older file of that name stays as it is; without Commit nothing is left.
/// A device or a pipe (/dev/stdout) is written straight away, a symbolic link is followed.
/// Survives the end of the process at any moment; a loss of power is the file system's matter.
///
/// Errors of all calls: one line "FILE: cannot be written: WHY; WHAT TO DO" under NOT_FOUND (no
/// such directory), PERMISSION_DENIED, RESOURCE_EXHAUSTED (disk full) or what else errno means.
class AtomicFile {
 public:
  /// Opens the temporary file, so that a place that cannot be written is known before the work.
  static absl::StatusOr<AtomicFile> Create(const std::filesystem::path& path);

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Appends through a buffer of 64 KiB: an error may be reported by a later call. After an error
  /// nothing more is written, and Commit fails too.
  absl::Status Append(std::string_view bytes);

  /// Writes what is left and gives the file its name. To be called once, last.
  absl::Status Commit();

 private:
  AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor);
  absl::Status Flush(std::string_view bytes);

  std::filesystem::path target_;
  std::filesystem::path temporary_;  // Empty for what is written straight away.
  int descriptor_ = -1;
  std::string buffer_;
  absl::Status status_;
};

/// Writes `bytes` as the whole content of `path`.
absl::Status WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace partiemc::client
