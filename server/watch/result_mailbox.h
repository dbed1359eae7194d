// Passes results from the compute thread to the thread that delivers them. The compute thread never
// waits: it exchanges a pointer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/functional/function_ref.h"

namespace partiemc::server {

/// A result in the form of its transport. Immutable, shared by all watchers.
class WatchFrame {
 public:
  explicit WatchFrame(std::size_t bytes) : WatchFrame(bytes, bytes) {}
  WatchFrame(std::size_t bytes, std::size_t memory) : bytes_(bytes), memory_(memory) {}
  virtual ~WatchFrame() = default;

  /// Size of the message.
  std::size_t bytes() const { return bytes_; }
  /// Bytes of memory that the frame keeps alive, including other parts of its response.
  std::size_t memory() const { return memory_; }

 private:
  const std::size_t bytes_, memory_;
};

/// A result of a stream with its number, which counts results from 1. Refused frames have sequence
/// numbers, but no result numbers.
struct Published {
  std::shared_ptr<const WatchFrame> frame;
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;  ///< Sequence number of the producer's frame.
};

/// Approximate overhead of a published frame, counted in addition to its bytes.
inline constexpr std::size_t kPublishedBytes = 512;

/// Put: one thread at a time. Take: any thread.
class ResultMailbox {
 public:
  /// Holds at most `max_bytes`, or one frame.
  explicit ResultMailbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  ~ResultMailbox() { Delete(posts_.load()); }
  ResultMailbox(const ResultMailbox&) = delete;
  ResultMailbox& operator=(const ResultMailbox&) = delete;

  /// Wait-free: two atomic exchanges. Keeps earlier frames that were not taken, unless they exceed
  /// `max_bytes` together.
  void Put(Published published);

  /// Passes the pending frames to `taker`, oldest first. Allocates nothing.
  void Take(absl::FunctionRef<void(Published)> taker);

 private:
  struct Post {
    Published published;
    Post* older = nullptr;
    std::size_t bytes = 0;  // Including all older posts.
  };

  static void Delete(Post* newest);

  const std::size_t max_bytes_;
  std::atomic<Post*> posts_ = nullptr;  // The newest post; owned.
};

}  // namespace partiemc::server
