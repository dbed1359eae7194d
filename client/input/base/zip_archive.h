// Reads zip files of numpy.savez: stored or deflated entries below 4 GiB.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

struct ZipEntry {
  std::string name;
  std::uint64_t offset = 0;  ///< Offset of the local header.
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint32_t crc = 0;
  std::uint16_t method = 0;  ///< 0 stored, 8 deflated; others cannot be opened.
};

/// The directory of an archive. Every offset and size is checked against the file.
class ZipArchive {
 public:
  /// kDataLoss if the file is not a zip archive, is truncated, has over 65,535 entries or bytes
  /// behind its directory. kUnimplemented for encrypted entries and entries beyond 4 GiB.
  static absl::StatusOr<ZipArchive> Open(const std::string& path);

  const std::vector<ZipEntry>& entries() const { return entries_; }

  /// Opens an entry for reading. At the end of the entry its checksum and size are verified:
  /// kDataLoss if they differ. kUnimplemented for methods other than stored and deflated.
  absl::StatusOr<std::unique_ptr<ByteSource>> OpenEntry(const ZipEntry& entry) const;

 private:
  std::string path_;
  std::uint64_t file_bytes_ = 0;
  std::vector<ZipEntry> entries_;
};

}  // namespace partiemc::client::input
