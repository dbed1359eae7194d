// Computes levels of detail for watchers, on a separate thread with low priority. Independent of
// messages.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "partiemc/surface_level.h"
#include "server/watch/result_mailbox.h"
#include "server/watch/watch_dispatcher.h"

namespace partiemc::server {

inline constexpr std::string_view kReasonTooManyLevels = "TOO_MANY_LEVELS";

/// Computes each level once for each frame, for all watchers that share it. A level waits for its
/// turn: all pairs of a stream and a level take turns, and a pair computes its frames in order.
/// Some watchers may skip frames. If one of them requests a frame that is not in the queue, the
/// others skip the frames in the queue. So these watchers meet at the newest frame, and at most one
/// frame of a pair waits for them.
///
/// Compute threads never wait for levels: the thread has a low priority, uses one processor, and
/// passes its results to the dispatcher. Computed levels are kept for further watchers of the same
/// frame, within `kept_bytes`, until another level needs the memory or the last watcher of the pair
/// leaves.
///
/// Thread-safe. Held by shared_ptr.
class LevelQueue final : public Dispatched {
 public:
  using Frame = std::shared_ptr<const WatchFrame>;
  /// A level, or the error that prevented it.
  struct Made {
    absl::StatusOr<Frame> level = Frame();
    bool may_succeed_later = false;  ///< After an error: watchers that may skip the frame skip it.
  };
  /// Makes the level of a frame, on the queue's thread. Ends soon after `cancelled` is set. Does
  /// not throw.
  using Compute = std::function<Made(const Frame& exact, const LevelOfDetail& level,
                                     const std::atomic<bool>& cancelled)>;

  struct Limits {
    std::size_t levels_per_stream = 8;  ///< Different levels that watchers may share.
    std::size_t kept_bytes = std::size_t{32} << 20;
  };

  /// A watcher that has requested a level of a frame.
  class Waiter {
   public:
    virtual ~Waiter() = default;
    /// The dispatcher's thread calls this once for each request that was not withdrawn. A null
    /// frame: the watcher skips the frame.
    virtual void LevelDone(const absl::StatusOr<Frame>& level) = 0;
  };

 private:
  struct Group;

 public:
  /// The registration of a watcher for a level of a stream; move-only. The destructor ends it.
  class Seat {
   public:
    Seat() = default;
    Seat(Seat&& other) noexcept
        : queue_(std::exchange(other.queue_, nullptr)), group_(other.group_) {}
    Seat& operator=(Seat&& other) noexcept {
      std::swap(queue_, other.queue_);
      std::swap(group_, other.group_);
      return *this;
    }
    ~Seat() {
      if (queue_ != nullptr) queue_->Leave(*group_);
    }
    explicit operator bool() const { return queue_ != nullptr; }

   private:
    friend class LevelQueue;
    Seat(LevelQueue& queue, Group& group) : queue_(&queue), group_(&group) {}

    LevelQueue* queue_ = nullptr;
    Group* group_ = nullptr;
  };

  /// Requires: `dispatcher` outlives the queue.
  LevelQueue(WatchDispatcher& dispatcher, Compute compute, const Limits& limits)
      : dispatcher_(dispatcher), compute_(std::move(compute)), limits_(limits) {}
  ~LevelQueue() override { Stop(); }

  /// Adds a watcher to a level of a stream. `stream`: address of an object that identifies the
  /// stream and outlives the seat. The seat must not outlive the queue.
  /// Errors, with a Violation: RESOURCE_EXHAUSTED (TOO_MANY_LEVELS), if `levels_per_stream` other
  /// levels have watchers.
  absl::StatusOr<Seat> Join(const void* stream, const LevelOfDetail& level)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Requests the level of `exact`; returns at once. Requires: the waiter has no other request.
  void Request(const Seat& seat, Frame exact, bool may_skip, Waiter& waiter)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Withdraws the request of `waiter`. Returns false if there is none, or if LevelDone has begun
  /// or is about to begin.
  bool Withdraw(const Waiter& waiter) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Cancels the running level and ends the thread. Requests in the queue get no LevelDone.
  /// Requests of the running level and of finished levels may get it after Stop.
  void Stop() ABSL_LOCKS_EXCLUDED(mutex_);

  /// `computed`: number of levels that were computed. `shared`: number of requests that needed no
  /// computation of their own, because the level is kept, being computed or already requested.
  std::uint64_t computed() const { return computed_; }
  std::uint64_t shared() const { return shared_; }
  /// Bytes of the levels that are kept.
  std::uint64_t kept_bytes() const { return kept_bytes_; }
  /// Number of levels of all streams that have watchers.
  std::size_t level_count() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Number of levels that wait for the thread or are being computed.
  std::size_t waiting() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  using Key = std::pair<const void*, LevelOfDetail>;
  struct Asked {
    Waiter* waiter = nullptr;
    bool may_skip = false;
  };
  struct Job {
    Frame exact;
    std::vector<Asked> requests;
  };
  struct Group {
    Key key;
    std::size_t seats = 0;
    std::deque<Job> jobs;  // The group is in ready_ if there are any.
  };
  struct Running {
    Group* group = nullptr;  // The group of `job`; null once the group has no watcher.
    Job job;
  };
  struct Kept {
    std::pair<const Group*, const WatchFrame*> key;
    std::weak_ptr<const WatchFrame> exact;
    Frame level;
    std::size_t bytes = 0;
  };
  struct Done {
    Waiter* waiter = nullptr;
    absl::StatusOr<Frame> level;
  };

  void Serve() override ABSL_LOCKS_EXCLUDED(mutex_);
  void Run() ABSL_LOCKS_EXCLUDED(mutex_);
  void Leave(Group& group) ABSL_LOCKS_EXCLUDED(mutex_);
  void SkipOlder(Group& group) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Finish(const Made& made) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Frame FindKept(const Group& group, const Frame& exact) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Keep(const Group& group, const Frame& exact, const Frame& level)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Drop(std::list<Kept>::iterator kept) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  WatchDispatcher& dispatcher_;
  const Compute compute_;
  const Limits limits_;
  std::atomic<std::uint64_t> computed_ = 0, shared_ = 0, kept_bytes_ = 0;
  std::atomic<bool> cancelled_ = false;  // The running job must end: no watcher waits, or Stop.

  mutable Mutex mutex_;
  CondVar job_came_;
  std::map<Key, Group> groups_ ABSL_GUARDED_BY(mutex_);
  std::deque<Group*> ready_ ABSL_GUARDED_BY(mutex_);  // Groups with jobs, in turn.
  std::optional<Running> running_ ABSL_GUARDED_BY(mutex_);
  std::vector<Done> done_ ABSL_GUARDED_BY(mutex_);
  std::list<Kept> kept_ ABSL_GUARDED_BY(mutex_);  // The first one is the oldest.
  std::map<std::pair<const Group*, const WatchFrame*>, std::list<Kept>::iterator> kept_by_frame_
      ABSL_GUARDED_BY(mutex_);
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_ ABSL_GUARDED_BY(mutex_);  // Started by the first Join.
};

}  // namespace partiemc::server
