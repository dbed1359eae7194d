// Reads and decompresses files. Declared sizes are not trusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::client::input {

/// Largest number of particles of a frame (1.1 GB of positions).
inline constexpr std::size_t kMaxParticles = std::size_t{1} << 26;

/// Largest ratio of unpacked to packed bytes of a file. A file may always unpack to
/// kFreeExpansionBytes. Particle dumps pack to a third of their size, or to a hundredth if nothing
/// moves.
inline constexpr double kMaxExpansion = 1000;
inline constexpr std::uint64_t kFreeExpansionBytes = std::uint64_t{64} << 20;

/// Whether `unpacked` bytes are more than a file of `packed` bytes may unpack to.
bool ExpandsTooMuch(std::uint64_t unpacked, std::uint64_t packed, double max_expansion);
/// The broken rule and the remedy, for an error message.
std::string ExpansionRule(double max_expansion);

/// A stream of bytes that is read once, in order.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Reads 1 to `size` bytes; 0 at the end. Requires: size > 0.
  virtual absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) = 0;
};

/// A regular file. Errors: kNotFound, kPermissionDenied, kFailedPrecondition (not a regular file).
absl::StatusOr<std::unique_ptr<ByteSource>> OpenFile(const std::string& path);

/// The bytes [offset, offset + size) of a file. Reading beyond the end of the file is an error.
std::unique_ptr<ByteSource> OpenFilePart(const std::string& path, std::uint64_t offset,
                                         std::uint64_t size);
absl::StatusOr<std::string> ReadFilePart(const std::string& path, std::uint64_t offset,
                                         std::size_t size);

/// A file of text or binary data, plain, gzip or zstd (recognised by its first bytes, not its
/// name). Reads ahead by blocks of at most 256 KiB. If the data is damaged, the bytes before the
/// damage are delivered before the error.
class InputStream final : public ByteSource {
 public:
  /// Errors: as OpenFile. Reading fails with kResourceExhausted once the file has expanded too
  /// much.
  static absl::StatusOr<std::unique_ptr<InputStream>> Open(const std::string& path,
                                                           double max_expansion = kMaxExpansion);

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override;

  /// The next `size` bytes, fewer at the end, without consuming them; valid until the next call.
  /// Requires: size <= 64 KiB.
  absl::StatusOr<std::string_view> Peek(std::size_t size);

  /// The next line without "\n" or "\r\n", valid until the next call. Returns false at the end.
  /// Skips a UTF-8 byte order mark at the beginning of the file. A line over 1 MiB is an error.
  absl::StatusOr<bool> ReadLine(std::string_view& line);

  const std::string& path() const { return path_; }
  bool compressed() const { return compressed_; }
  /// Number of the last line read, from 1.
  std::size_t line_number() const { return line_number_; }

  /// "PATH:LINE: message" with the number of the last line read.
  absl::Status ErrorAtLine(absl::StatusCode code, std::string_view message) const;

 private:
  InputStream(std::string path, std::unique_ptr<ByteSource> source, bool compressed);

  // Appends a block to the buffer. Returns false at the end or after an error (`failure_`).
  bool Fill();
  std::string_view Buffered() const { return std::string_view(buffer_).substr(position_); }

  std::string path_;
  std::unique_ptr<ByteSource> source_;
  bool compressed_;
  std::size_t block_bytes_;  // Size of the next read.
  bool at_end_ = false;
  absl::Status failure_;
  std::string buffer_;
  std::size_t position_ = 0;
  std::size_t line_number_ = 0;
};

/// Reads `size` bytes, fewer at the end. `bytes` grows with the bytes that arrive.
absl::Status ReadUpTo(ByteSource& source, std::size_t size, std::vector<char>& bytes);

}  // namespace partiemc::client::input
