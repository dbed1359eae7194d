// Decides from which streams the server reads while memory is short.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "common/mutex.h"

namespace partiemc::server {

class CallerAccount;
class MemoryBudget;

struct ReadTerms {
  /// Maximum number of streams with a frame beyond the budget at the same time, at least 1.
  std::uint32_t streams_beyond = 2;
  /// Size of the largest message in bytes, at least 1.
  std::uint64_t message_bytes = 1;
};

/// Grants permits to read. gRPC reports the size of a message only after the whole message has
/// arrived, and a read that has begun cannot be stopped. So a stream without a frame in flight
/// needs a permit for its next read:
///
/// 1. A permit plans the bytes that the read may bring: Read::expected_bytes, or the size of the
///    largest message if they are unknown. Planned bytes count in the budget like held bytes.
/// 2. If the planned bytes do not fit into the budget, the stream may get a slot, which permits one
///    frame beyond the budget. There are `streams_beyond` slots. If no slot is free, the read
///    waits. A stream keeps its slot until the response to the frame is sent or the bytes fit into
///    the budget. While it has a slot, the connection reads no other frame. Bytes in a slot take
///    no memory of the budget from other streams.
/// 3. If a stream's frames arrive in parts, its connections share one slot. They read one after the
///    other, each connection once, until they have received the size of the largest message.
/// 4. Waiting reads get permits in this order: streams that have a slot, callers with the fewest
///    slots, callers with the fewest bytes, longest wait. A read that does not fit is skipped.
/// 5. While other reads wait, the permit of an idle connection lapses: its read continues, but its
///    bytes are no longer planned and its slot is free. So an idle stream does not block others. A
///    lapsed read may receive bytes after all, and any read may receive more bytes than planned.
///    These bytes are planned as soon as they fit. If memory is exhausted before that, `Revoke`
///    ends such streams.
///
/// So all streams together hold at most the budget plus one message for each slot, or two messages
/// if the stream's frames arrive in parts. Thread-safe.
class ReadPermits {
 public:
  using Clock = std::chrono::steady_clock;

  class Reader {
   public:
    virtual ~Reader() = default;
    /// The waiting read may begin. Called without holding a lock.
    virtual void ReadPermitted() = 0;
    /// Memory is exhausted: the stream must end with `status` if its read is still in progress.
    /// Called without holding a lock.
    virtual void ReadRevoked(const absl::Status& status) = 0;
  };

  struct Read {
    const void* stream = nullptr;           ///< The same for all connections of one stream.
    std::uint64_t expected_bytes = 0;       ///< 0: unknown.
    const CallerAccount* caller = nullptr;  ///< Lives until End.
    std::string peer;                       ///< As CallChannel::peer.
  };

  /// Returns the bytes that the connection of a peer has received so far, or nothing if the number
  /// is unknown.
  using ReceivedBytes = std::function<std::optional<std::uint64_t>(const std::string& peer)>;

  ReadPermits(MemoryBudget& budget, const ReadTerms& terms);

  // For readers. A reader may hold its own lock. It calls Serve after it has released this lock.

  /// Requests a permit for a reader that has no frame in flight. Returns false if the read must
  /// wait; ReadPermitted is called later.
  bool Begin(const std::shared_ptr<Reader>& reader, Read read) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Whether a reader with a frame in flight may claim memory for its next frame: not while its
  /// frame in flight needs the slot. Frees the slot if the bytes fit into the budget.
  bool MayReadAhead(const Reader& reader) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Bytes that a permit plans for a read with this Read::expected_bytes.
  std::uint64_t PlannedBytes(std::uint64_t expected_bytes) const;
  /// Like Begin, but always permits the read. Requires: MayReadAhead, and MemoryBudget has just
  /// granted PlannedBytes.
  void BeginNow(const std::shared_ptr<Reader>& reader, Read read) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Records that the read is complete: its bytes are no longer planned. Requires: the received
  /// `bytes` were taken from the budget (MemoryBudget::Take). Errors: RESOURCE_EXHAUSTED
  /// (MEMORY_BUDGET, CALLER_BYTES) if the permit has lapsed and the bytes do not fit.
  absl::Status Came(const Reader& reader, std::uint64_t bytes) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the reader and its permit, when it stops waiting or has ended. Idempotent.
  void End(const Reader& reader) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Grants claims and permits waiting reads that fit now. Requires: the calling thread holds no
  /// lock.
  void Serve();

  // For the thread that watches the memory of the process (IntakeGuard):

  /// Whether Look is needed. True if reads wait, if permits have lapsed, or if sum A exceeds sum B.
  /// A: held bytes, planned bytes and one largest message for each read in progress. B: the budget
  /// and one largest message for each slot.
  bool NeedsLook() const;
  /// Whether Look needs the received bytes: reads wait, so permits may lapse, or some have lapsed.
  bool NeedsBytes() const { return waiting_ > 0 || lapsed_ > 0; }
  /// Sets the function that Begin calls if the read must wait or if NeedsLook is true. The calling
  /// thread may hold a reader's lock. Empty: no call.
  void OnWaiting(std::function<void()> tell) ABSL_LOCKS_EXCLUDED(tell_mutex_);
  /// Lets the permits of idle connections lapse if reads wait. If a read received more bytes than
  /// planned, plans the bytes that it may still bring, provided that they fit. Then calls Serve.
  void Look(Clock::time_point now, const ReceivedBytes& received) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Ends streams because memory is exhausted. A read is at risk if less than a largest message is
  /// planned for it, and if it receives bytes now or has received more than planned. If the
  /// received bytes are unknown, a read with a lapsed permit is at risk. Keeps one read at risk for
  /// each largest message that fits into `free_bytes`; callers take turns in keeping a read. Ends
  /// the other streams at risk, and returns their number.
  std::size_t Revoke(std::uint64_t free_bytes) ABSL_LOCKS_EXCLUDED(mutex_);

  std::size_t waiting() const { return waiting_; }
  std::size_t streams_beyond() const ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  enum class State { kWaiting, kReading, kHolding };
  struct Permit {
    std::weak_ptr<Reader> reader;
    Read read;
    State state = State::kWaiting;
    std::uint64_t number = 0;   // Number of the request in the order of requests; 0: none yet.
    std::uint64_t planned = 0;  // Bytes planned in the budget.
    std::uint64_t beyond = 0;   // Bytes in its slot, planned or held.
    bool has_slot = false, has_lapsed = false;
    // Measured by Look:
    std::optional<std::uint64_t> received;  // Received bytes of the connection when `came` was set.
    // `came`: bytes received from the first Look until `received` was set. `grown`: bytes that the
    // last Look found in addition to the previous value of `received`.
    std::uint64_t came = 0, grown = 0;
    std::optional<Clock::time_point> moved;  // When the connection last was not idle.
  };
  using Permits = std::map<const Reader*, Permit>;
  // Permits one frame beyond the budget. All connections of a stream share one slot.
  struct Slot {
    std::uint64_t bytes = 0;       // Received bytes.
    bool reading = false;          // Whether one of the stream's connections reads.
    std::set<const Reader*> used;  // Connections that have used the slot.
    std::set<const Reader*> open;  // Connections that use it still.
  };

  Permit& Renew(const std::shared_ptr<Reader>& reader, Read read)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool TryPermit(Permits::value_type& item, bool may_open_slot)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  Slot* FindSlot(const Permits::value_type& item, bool may_open_slot)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Unplan(Permit& permit) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void SetBeyond(Permit& permit, std::uint64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Finish(Permits::value_type& item) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void FreeSlotIfFits(const Reader* reader, Permit& permit) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void FreeSlots() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LeaveSlot(const Reader* reader, Permit& permit) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::shared_ptr<Reader> PermitNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Measure(Permit& permit, Clock::time_point now, const ReceivedBytes& received)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LapseOrCover(Permits::value_type& item, Clock::time_point now)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool IsAtRisk(const Permit& permit) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void ServeWaiting() ABSL_LOCKS_EXCLUDED(mutex_);
  void TellWaiting() const ABSL_LOCKS_EXCLUDED(tell_mutex_);

  friend class MemoryBudget;

  MemoryBudget& budget_;
  const ReadTerms terms_;
  std::atomic<std::size_t> waiting_ = 0, reading_ = 0, lapsed_ = 0;
  std::atomic<bool> changed_ = false;  // Since the last Serve.

  mutable Mutex mutex_;
  Permits permits_ ABSL_GUARDED_BY(mutex_);
  std::map<const void*, Slot> slots_ ABSL_GUARDED_BY(mutex_);  // The key is Read::stream.
  std::uint64_t numbers_ ABSL_GUARDED_BY(mutex_) = 0;

  mutable Mutex tell_mutex_;
  std::function<void()> tell_waiting_ ABSL_GUARDED_BY(tell_mutex_);
};

}  // namespace partiemc::server
