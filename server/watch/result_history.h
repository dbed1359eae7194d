// Keeps the newest results of a stream, for watchers that start with an earlier result. Shares the
// frames with the watchers without copies.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/mutex.h"
#include "server/watch/result_mailbox.h"

namespace partiemc::server {

/// Sequence numbers of a history.
struct HeldFrames {
  bool any = false;
  std::uint64_t oldest = 0, newest = 0;  ///< 0 without frames.
};

/// The owner of a history.
class HistoryOwner {
 public:
  virtual ~HistoryOwner() = default;
  /// Schedules the history to shrink, because other histories have started and share the memory.
  /// Does not block.
  virtual void ShareRoom() = 0;
};

/// The memory limit of all histories, which share it equally. Thread-safe; all functions but Enter
/// are lock-free.
class HistoryRoom {
 public:
  /// `bytes_of_one` limits each history, `bytes_of_all` their total.
  HistoryRoom(std::uint64_t bytes_of_one, std::uint64_t bytes_of_all)
      : bytes_of_one_(bytes_of_one), bytes_of_all_(bytes_of_all) {}

  /// Adds the owner of a history that has started. If the share of each history has become smaller,
  /// calls ShareRoom of the other owners that still exist, also of those whose streams have ended.
  void Enter(std::weak_ptr<HistoryOwner> owner) ABSL_LOCKS_EXCLUDED(mutex_);

  /// The current limit of each history.
  std::uint64_t share() const {
    return std::min(bytes_of_one_, bytes_of_all_ / std::max<std::uint64_t>(1, histories_));
  }
  /// Whether the number of histories reduces the share of each below `bytes_of_one`.
  bool is_scarce() const { return share() < bytes_of_one_; }
  /// Bytes of all histories.
  std::uint64_t held() const { return held_; }

 private:
  friend class ResultHistory;

  bool TryTake(std::uint64_t bytes);
  void GiveBack(std::uint64_t bytes) { held_ -= bytes; }

  const std::uint64_t bytes_of_one_, bytes_of_all_;
  std::atomic<std::uint64_t> histories_ = 0, held_ = 0;
  Mutex mutex_;
  std::vector<std::weak_ptr<HistoryOwner>> owners_ ABSL_GUARDED_BY(mutex_);
};

/// The newest frames without gaps. If a frame cannot be added because it exceeds the limit, all
/// frames are dropped. Not thread-safe. Allocates only if it holds more frames than ever before.
class ResultHistory {
 public:
  /// Requires: `room` outlives this.
  explicit ResultHistory(HistoryRoom& room);
  ~ResultHistory();
  ResultHistory(const ResultHistory&) = delete;
  ResultHistory& operator=(const ResultHistory&) = delete;

  /// Adds the newest frame. Drops all older frames if the result numbers have a gap before the new
  /// frame. Drops the oldest frames until the new frame fits. If it does not fit at all, drops all
  /// frames.
  void Add(const Published& published);
  /// Drops the oldest frames until the history fits into its share, which may have become smaller.
  void Shrink() { DropUntilFits(0); }

  /// Copies the newest frames before `sequence` that fit into the share of a history and into the
  /// remaining memory of all histories.
  std::unique_ptr<ResultHistory> CopyBefore(std::uint64_t sequence) const;
  /// Removes the frames from `sequence` on, and returns them. The caller frees them without locks,
  /// because they may be large.
  std::vector<Published> TakeFrom(std::uint64_t sequence);

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  /// Bytes of all frames, including the overhead of each frame.
  std::uint64_t bytes() const { return bytes_; }
  /// The k-th frame; 0 is the oldest.
  const Published& at(std::size_t k) const { return ring_[(first_ + k) % ring_.size()]; }

  /// The first frame with at least this result number or sequence number; null if all frames are
  /// older.
  const Published* FromNumber(std::uint64_t number) const;
  const Published* FromSequence(std::uint64_t sequence) const;

 private:
  // Number of frames before `sequence`.
  std::size_t CountBefore(std::uint64_t sequence) const;
  void DropOldest();
  void DropUntilFits(std::uint64_t bytes);
  void Grow();

  HistoryRoom& room_;
  std::vector<Published> ring_;
  std::size_t first_ = 0, size_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace partiemc::server
