#include "client/recording/block.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace partiemc::client::recording {
namespace {

static_assert(std::endian::native == std::endian::little, "marks are written as they are");

constexpr std::uint32_t kSkippableMagic = 0x184D2A50;
constexpr std::uint32_t kSkippableBytes = kMarkBytes - 8;
constexpr std::size_t kInputBytes = 128 * 1024;

template <typename T>
void AppendRaw(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <typename T>
T ReadRaw(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

}  // namespace

std::string MakeMark(std::string_view tag, std::uint64_t value) {
  std::string mark;
  AppendRaw(mark, kSkippableMagic);
  AppendRaw(mark, kSkippableBytes);
  mark += tag;
  AppendRaw(mark, value);
  return mark;
}

std::optional<std::uint64_t> ParseMark(std::string_view bytes, std::string_view tag) {
  const std::uint64_t value = ReadRaw<std::uint64_t>(bytes, kMarkBytes - sizeof(std::uint64_t));
  if (bytes != MakeMark(tag, value)) return std::nullopt;
  return value;
}

BlockPacker::BlockPacker(int compression_level) : context_(ZSTD_createCCtx()) {
  ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, compression_level);
  ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_checksumFlag, 1);
}

absl::StatusOr<std::string_view> BlockPacker::Pack(std::string_view block) {
  if (block.size() > kMaxBlockBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat("a frame has more than ", kMaxBlockBytes, " bytes, which no recording holds"));
  }
  packed_.resize(ZSTD_compressBound(block.size()));
  const std::size_t size =
      ZSTD_compress2(context_.get(), packed_.data(), packed_.size(), block.data(), block.size());
  if (ZSTD_isError(size)) {
    return absl::ResourceExhaustedError(
        absl::StrCat("cannot compress a block of frames: ", ZSTD_getErrorName(size)));
  }
  return std::string_view(packed_).substr(0, size);
}

BlockReader::BlockReader(std::ifstream file, double max_expansion, std::size_t max_block_bytes)
    : file_(std::move(file)),
      context_(ZSTD_createDCtx()),
      max_expansion_(max_expansion),
      max_block_bytes_(max_block_bytes) {}

absl::StatusOr<BlockReader> BlockReader::Open(const std::string& path, double max_expansion,
                                              std::size_t max_block_bytes) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return absl::Status(absl::ErrnoToStatusCode(errno),
                        absl::StrCat("cannot be read: ", std::strerror(errno)));
  }
  BlockReader reader(std::move(file), max_expansion, max_block_bytes);
  const std::string_view bytes = reader.Peek(kMarkBytes);
  const auto version =
      bytes.size() == kMarkBytes ? ParseMark(bytes, kFileTag) : std::optional<std::uint64_t>();
  if (!version) {
    return absl::DataLossError("is no recording: it does not begin with the mark of one");
  }
  if (*version != kVersion) {
    return absl::UnimplementedError(absl::StrCat("is a recording of version ", *version,
                                                 ", this program reads version ", kVersion,
                                                 ": use a newer one"));
  }
  reader.position_ += kMarkBytes;
  return reader;
}

bool BlockReader::Fill() {
  input_.erase(0, position_);
  position_ = 0;
  const std::size_t size = input_.size();
  input_.resize(size + kInputBytes);
  file_.read(input_.data() + size, kInputBytes);
  input_.resize(size + static_cast<std::size_t>(file_.gcount()));
  read_ += input_.size() - size;
  return input_.size() > size;
}

std::string_view BlockReader::Peek(std::size_t size) {
  while (input_.size() - position_ < size && Fill()) {
  }
  return std::string_view(input_).substr(position_, size);
}

absl::StatusOr<BlockReader::Piece> BlockReader::Next(std::string_view& block) {
  const std::string_view magic = Peek(sizeof(kSkippableMagic));
  if (magic.size() < sizeof(kSkippableMagic)) return Piece::kTruncated;
  if (ReadRaw<std::uint32_t>(magic, 0) == kSkippableMagic) return ReadTail();
  return Unpack(block);
}

absl::StatusOr<BlockReader::Piece> BlockReader::ReadTail() {
  const std::string_view bytes = Peek(kMarkBytes + 1);
  if (bytes.size() < kMarkBytes) return Piece::kTruncated;
  const auto count = ParseMark(bytes.substr(0, kMarkBytes), kTailTag);
  if (!count) return absl::DataLossError("a mark is damaged");
  if (bytes.size() > kMarkBytes) return absl::DataLossError("there are bytes behind the end");
  frame_count_ = *count;
  return Piece::kTail;
}

absl::StatusOr<BlockReader::Piece> BlockReader::Unpack(std::string_view& block) {
  ZSTD_DCtx_reset(context_.get(), ZSTD_reset_session_only);
  std::size_t used = 0;
  std::size_t left = 1;
  while (left != 0) {
    if (position_ == input_.size() && !Fill()) return Piece::kTruncated;
    if (block_.size() - used < ZSTD_DStreamOutSize()) {
      // One byte more than allowed shows that a block is too large.
      block_.resize(std::min(2 * block_.size() + ZSTD_DStreamOutSize(), max_block_bytes_ + 1));
    }
    ZSTD_inBuffer in{input_.data(), input_.size(), position_};
    ZSTD_outBuffer out{block_.data(), block_.size(), used};
    left = ZSTD_decompressStream(context_.get(), &out, &in);
    position_ = in.pos;
    used = out.pos;
    if (ZSTD_isError(left)) return absl::DataLossError(ZSTD_getErrorName(left));
    if (used > max_block_bytes_) {
      return absl::DataLossError(
          absl::StrCat("a block is larger than ", max_block_bytes_, " bytes"));
    }
    if (input::ExpandsTooMuch(unpacked_ + used, read_, max_expansion_)) {
      return absl::ResourceExhaustedError(input::ExpansionRule(max_expansion_));
    }
  }
  unpacked_ += used;
  block = std::string_view(block_).substr(0, used);
  return Piece::kBlock;
}

}  // namespace partiemc::client::recording
