// Where a stream's results pass from the worker that made them to whoever shows them to watchers.
// The worker's side never waits: it exchanges a pointer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/functional/function_ref.h"

namespace partiemc::server {

/// A result as its transport made it for watchers: immutable, one for all of them.
class WatchFrame {
 public:
  explicit WatchFrame(std::size_t bytes) : WatchFrame(bytes, bytes) {}
  WatchFrame(std::size_t bytes, std::size_t memory) : bytes_(bytes), memory_(memory) {}
  virtual ~WatchFrame() = default;

  /// Of the message.
  std::size_t bytes() const { return bytes_; }
  /// That is kept by whoever keeps the frame: with what its answer has beside it, a checkpoint say.
  std::size_t memory() const { return memory_; }

 private:
  const std::size_t bytes_, memory_;
};

/// A result of a stream and its number: 1 for the first, then one more each. Refused frames use up
/// sequence numbers, but none of these.
struct Published {
  std::shared_ptr<const WatchFrame> frame;
  std::uint64_t number = 0;
  std::uint64_t sequence = 0;  ///< Of the producer's frame.
};

/// What a published frame costs beside its bytes, roughly: so many small ones count as what they
/// are.
inline constexpr std::size_t kPublishedBytes = 512;

/// Put comes from one thread at a time, Take from any thread.
class ResultMailbox {
 public:
  /// Holds at most `max_bytes`, or one frame.
  explicit ResultMailbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  ~ResultMailbox() { Delete(posts_.load()); }
  ResultMailbox(const ResultMailbox&) = delete;
  ResultMailbox& operator=(const ResultMailbox&) = delete;

  /// Wait-free: two exchanges, whatever the other side does. What has not been taken yet stays
  /// before it, unless that would be too much.
  void Put(Published published);

  /// Hands over what has come since, the oldest first. Allocates nothing.
  void Take(absl::FunctionRef<void(Published)> taker);

 private:
  struct Post {
    Published published;
    Post* older = nullptr;
    std::size_t bytes = 0;  // With all older ones.
  };

  static void Delete(Post* newest);

  const std::size_t max_bytes_;
  std::atomic<Post*> posts_ = nullptr;  // The newest one; owned.
};

}  // namespace partiemc::server
