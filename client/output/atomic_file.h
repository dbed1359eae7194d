// Files that appear complete or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::client {

/// A file that is written under a hidden temporary name in its directory. Commit renames it. Until
/// then an older file of the same name is unchanged, even if the process is killed. Protection from
/// a power loss depends on the file system. Without Commit the destructor removes the temporary
/// file. A device or a pipe (/dev/stdout) is written directly. A symbolic link is followed if its
/// target exists.
///
/// Errors of all calls: one line "FILE: cannot be written: CAUSE; REMEDY". The code is NOT_FOUND
/// (no such directory), PERMISSION_DENIED, RESOURCE_EXHAUSTED (disk full) or the code for another
/// errno.
class AtomicFile {
 public:
  /// Opens the temporary file, so that a path that cannot be written fails early.
  static absl::StatusOr<AtomicFile> Create(const std::filesystem::path& path);

  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Appends through a buffer of 64 KiB, so a later call may report an error. After an error
  /// nothing more is written, and Commit fails.
  absl::Status Append(std::string_view bytes);

  /// Writes the buffer and renames the file. Call once, last.
  absl::Status Commit();

 private:
  AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor);
  absl::Status Flush(std::string_view bytes);

  std::filesystem::path target_;
  std::filesystem::path temporary_;  // Empty for a device or pipe.
  int descriptor_ = -1;
  std::string buffer_;
  absl::Status status_;
};

/// Replaces the content of `path` by `bytes`.
absl::Status WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace partiemc::client
