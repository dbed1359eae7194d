// The results of a stream that its watchers can go back to: as many of the newest as there is room
// for. They are the frames that watchers get anyway; nothing of them is copied.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/watch/result_mailbox.h"

namespace partiemc::server {

/// Sequence numbers of what a stream holds for its watchers.
struct HeldFrames {
  bool any = false;
  std::uint64_t oldest = 0, newest = 0;  ///< 0 if there are none.
};

/// What the histories of all streams may hold together, in equal shares. Takes no lock; safe from
/// any thread.
class HistoryRoom {
 public:
  /// No history has more than `bytes_of_one`, all together have no more than `bytes_of_all`.
  HistoryRoom(std::uint64_t bytes_of_one, std::uint64_t bytes_of_all)
      : bytes_of_one_(bytes_of_one), bytes_of_all_(bytes_of_all) {}

  /// What each history may hold, with as many as there are now.
  std::uint64_t share() const {
    return std::min(bytes_of_one_, bytes_of_all_ / std::max<std::uint64_t>(1, histories_));
  }
  /// Whether one more history makes the share of each smaller.
  bool is_scarce() const { return share() < bytes_of_one_; }
  /// By all.
  std::uint64_t held() const { return held_; }

 private:
  friend class ResultHistory;

  bool TryTake(std::uint64_t bytes);
  void GiveBack(std::uint64_t bytes) { held_ -= bytes; }

  const std::uint64_t bytes_of_one_, bytes_of_all_;
  std::atomic<std::uint64_t> histories_ = 0, held_ = 0;
};

/// Frames without a hole: a frame that there is no room for ends what came before it. Not
/// thread-safe. Allocates nothing once it has been full.
class ResultHistory {
 public:
  /// `room` lives longer.
  explicit ResultHistory(HistoryRoom& room);
  ~ResultHistory();
  ResultHistory(const ResultHistory&) = delete;
  ResultHistory& operator=(const ResultHistory&) = delete;

  /// The newest frame. Drops the oldest ones until it fits, or all with it where it does not.
  void Add(const Published& published);
  /// Drops the oldest ones beyond the share, which has become smaller.
  void Shrink() { DropUntilFits(0); }

  bool empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  /// With what each frame costs beside its bytes.
  std::uint64_t bytes() const { return bytes_; }
  /// 0 is the oldest.
  const Published& at(std::size_t k) const { return ring_[(first_ + k) % ring_.size()]; }

  /// The first frame of at least this number, or of at least this sequence number; null if all are
  /// older.
  const Published* FromNumber(std::uint64_t number) const;
  const Published* FromSequence(std::uint64_t sequence) const;

 private:
  void DropOldest();
  void DropUntilFits(std::uint64_t bytes);
  void Grow();

  HistoryRoom& room_;
  std::vector<Published> ring_;
  std::size_t first_ = 0, size_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace partiemc::server
