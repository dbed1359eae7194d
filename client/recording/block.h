// The elements of a recording file: marks and compressed blocks.
#pragma once

#include <zstd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::recording {

/// Limit on a decompressed block: enough for a frame of 2^24 particles with all arrays. Larger
/// blocks are neither written nor read.
inline constexpr std::size_t kMaxBlockBytes = std::size_t{1} << 30;

/// Limit on the attributes of a frame.
inline constexpr std::size_t kMaxAttributes = 4096;

inline constexpr std::string_view kFileTag = "PEMCFILE";
inline constexpr std::string_view kTailTag = "PEMCTAIL";
inline constexpr std::uint64_t kVersion = 1;

/// Size of a mark: zstd's magic number of a skippable frame, its length, a tag of 8 bytes, a value
/// of 8 bytes.
inline constexpr std::size_t kMarkBytes = 4 + 4 + 8 + 8;
std::string MakeMark(std::string_view tag, std::uint64_t value);
/// The value of a mark. Empty if `bytes` are no mark with this tag. Requires: bytes.size() ==
/// kMarkBytes.
std::optional<std::uint64_t> ParseMark(std::string_view bytes, std::string_view tag);

class BlockPacker {
 public:
  explicit BlockPacker(int compression_level);
  /// Returns `block` compressed, valid until the next call. Errors: RESOURCE_EXHAUSTED.
  absl::StatusOr<std::string_view> Pack(std::string_view block);

 private:
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, Free> context_;
  std::string packed_;
};

/// Reads marks and blocks from a file, in order.
class BlockReader {
 public:
  enum class Piece : std::uint8_t {
    kBlock,      ///< A complete block with a valid checksum.
    kTail,       ///< The mark at the end of a complete recording.
    kTruncated,  ///< The file ends without a tail.
  };

  /// Reads the first mark. `max_expansion` limits the decompressed bytes of all blocks
  /// (input::ExpandsTooMuch), `max_block_bytes` those of each block. Errors: kNotFound,
  /// kPermissionDenied, kUnimplemented (another version), kDataLoss (not a recording).
  static absl::StatusOr<BlockReader> Open(const std::string& path,
                                          double max_expansion = input::kMaxExpansion,
                                          std::size_t max_block_bytes = kMaxBlockBytes);

  /// Reads the next piece. `block` is valid until the next call. Errors: kDataLoss;
  /// kResourceExhausted if blocks expand too much.
  absl::StatusOr<Piece> Next(std::string_view& block);

  /// The frame count of the tail; valid after Next has returned kTail.
  std::uint64_t frame_count() const { return frame_count_; }

 private:
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };

  BlockReader(std::ifstream file, double max_expansion, std::size_t max_block_bytes);
  bool Fill();  // Returns false at the end of the file.
  std::string_view Peek(std::size_t size);
  absl::StatusOr<Piece> Unpack(std::string_view& block);
  absl::StatusOr<Piece> ReadTail();

  std::ifstream file_;
  std::unique_ptr<ZSTD_DCtx, Free> context_;
  double max_expansion_;
  std::size_t max_block_bytes_;
  std::uint64_t read_ = 0;      // Bytes read from the file.
  std::uint64_t unpacked_ = 0;  // Decompressed bytes of the earlier blocks.
  std::string input_;           // Buffered bytes of the file.
  std::size_t position_ = 0;    // Number of consumed bytes of `input_`.
  std::string block_;
  std::uint64_t frame_count_ = 0;
};

}  // namespace partiemc::client::recording
