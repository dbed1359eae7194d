#include "server/web/gathered_message.h"

#include <algorithm>

namespace partiemc::server {
namespace {

constexpr std::size_t kLeastChunk = 256;  // Well above the size that gRPC stores inside a slice.
constexpr std::size_t kFirstChunk = 16 << 10;
// Maximum size of a chunk: large enough that the number of chunks stays small, small enough that
// malloc reuses freed chunks.
constexpr std::size_t kMostChunk = 1 << 20;

}  // namespace

std::span<std::uint8_t> GatheredMessage::Room(std::size_t expected) {
  if (filled_ == chunk_.size()) {
    CloseChunk();
    const std::size_t most = std::clamp(size_, kFirstChunk, kMostChunk);
    chunk_ = grpc::Slice(std::clamp(expected, kLeastChunk, most));
  }
  // Writing to the slice is safe, because it is not shared with any buffer yet.
  return {const_cast<std::uint8_t*>(chunk_.begin()) + filled_, chunk_.size() - filled_};
}

void GatheredMessage::Filled(std::size_t bytes) {
  filled_ += bytes;
  size_ += bytes;
}

void GatheredMessage::CloseChunk() {
  if (filled_ > 0) {
    whole_.push_back(filled_ == chunk_.size() ? std::move(chunk_) : chunk_.sub(0, filled_));
  }
  chunk_ = grpc::Slice();
  filled_ = 0;
}

grpc::ByteBuffer GatheredMessage::Take() {
  CloseChunk();
  if (whole_.empty()) whole_.emplace_back();  // An empty message is valid.
  grpc::ByteBuffer message(whole_.data(), whole_.size());
  Clear();
  return message;
}

void GatheredMessage::Clear() {
  whole_.clear();
  chunk_ = grpc::Slice();
  filled_ = size_ = 0;
}

}  // namespace partiemc::server
