// Passes results from the compute thread to the thread that delivers them. The compute thread never
// waits: it exchanges a pointer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/functional/function_ref.h"

namespace partiemc::server {

/// A result, serialised for the transport. Immutable, shared by all watchers.
class WatchFrame {
 public:
  explicit WatchFrame(std::size_t bytes) : WatchFrame(bytes, bytes) {}
  WatchFrame(std::size_t bytes, std::size_t memory) : bytes_(bytes), memory_(memory) {}
  virtual ~WatchFrame() = default;

  /// Size of the message.
  std::size_t bytes() const { return bytes_; }
  /// Bytes of memory that this frame keeps allocated, including other parts of the response that
  /// contains it.
  std::size_t memory() const { return memory_; }

 private:
  const std::size_t bytes_, memory_;
};

/// Approximate memory overhead of a published frame, counted in addition to its bytes.
inline constexpr std::size_t kPublishedBytes = 512;

/// A result of a stream and its result number, which counts results from 1. Refused frames have
/// sequence numbers but no result numbers.
struct Published {
  std::shared_ptr<const WatchFrame> frame;
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;  ///< Sequence number of the producer's frame.
  /// Number of the newest result, up to this one, directly before which results were lost on their
  /// way between servers. 0: none were lost. Later results repeat it, so that a watcher finds the
  /// loss even if the result after the loss is dropped.
  std::uint64_t last_loss = 0;

  /// Bytes that count while the result waits for its delivery. Requires: `frame` is not null.
  std::size_t pending_bytes() const { return frame->bytes() + kPublishedBytes; }
};

/// A lock-free list of results that were published but not processed yet. Put is called by one
/// thread at a time, Take by any thread.
class ResultMailbox {
 public:
  /// Holds frames of at most `max_bytes` together; a single frame may be larger.
  explicit ResultMailbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  ~ResultMailbox() { Delete(posts_.load()); }
  ResultMailbox(const ResultMailbox&) = delete;
  ResultMailbox& operator=(const ResultMailbox&) = delete;

  /// Adds a frame. Wait-free: two atomic exchanges. Frames that were not taken yet are dropped if
  /// they exceed `max_bytes` together with the new frame.
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
