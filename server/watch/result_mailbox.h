// Where a stream's results pass from the worker that made them to whoever shows them to watchers.
// The worker's side never waits: it exchanges a pointer.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace partiemc::server {

/// A result as its transport made it for watchers: immutable, one for all of them.
class WatchFrame {
 public:
  explicit WatchFrame(std::size_t bytes) : bytes_(bytes) {}
  virtual ~WatchFrame() = default;

  /// Memory that is kept by whoever keeps the frame.
  std::size_t bytes() const { return bytes_; }

 private:
  const std::size_t bytes_;
};

/// A result of a stream and its number: 1 for the first, then one more each.
struct Published {
  std::shared_ptr<const WatchFrame> frame;
  std::uint64_t number = 0;
};

/// What a published frame costs beside its bytes, roughly: so many small ones count as what they
/// are.
inline constexpr std::size_t kPublishedBytes = 512;

/// Put and Clear come from one thread at a time, the others from any thread.
class ResultMailbox {
 public:
  /// Holds at most `max_bytes`, or one frame.
  explicit ResultMailbox(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  ~ResultMailbox() { Delete(posts_.load()); }
  ResultMailbox(const ResultMailbox&) = delete;
  ResultMailbox& operator=(const ResultMailbox&) = delete;

  /// Wait-free: two exchanges, whatever the other side does. What has not been taken yet stays
  /// before it if `keep_older`, unless that would be too much.
  void Put(Published published, bool keep_older);
  /// Wait-free. Drops what has not been taken.
  void Clear() { Delete(posts_.exchange(nullptr)); }

  /// What has come since, the oldest first.
  std::vector<Published> Take();
  /// Puts back what was taken, unless something newer is there.
  void PutBack(Published published);

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
