// Decides which streams the server reads from while memory is short.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace partiemc::server {

class CallerAccount;
class MemoryBudget;

struct ReadTerms {
  /// Streams that may hold a frame beyond the budget at the same time, at least 1.
  std::uint32_t streams_beyond = 2;
  /// The largest message, at least 1.
  std::uint64_t message_bytes = 1;
};

/// Gives permits to read. gRPC reports the size of a message only after the whole message has
/// arrived, and a read that has begun cannot be stopped. So a stream that has nothing in flight
/// needs a permit for its next read:
///
/// 1. A permit plans the bytes that the read can bring: the size of the stream's last frame, or of
///    the largest message if there was none. The budget counts planned bytes like bytes that are
///    held.
/// 2. If the budget has no room for them, the read waits, unless fewer than `streams_beyond`
///    streams have a frame beyond the budget. Such a stream keeps its slot until the frame is
///    answered. The connections of a stream whose frames come in parts have one slot together: they
///    are read from one after the other, once each, and not after they have brought one message.
///    Its bytes are counted beside the budget, so that it takes no room from others.
/// 3. Slots go to the caller that holds the least, and of one caller to the read that has waited
///    longest.
/// 4. While others wait, a permit lapses if its connection brings next to nothing: then the read
///    goes on, but its bytes are planned no longer. So an idle stream keeps no other from being
///    read. If a lapsed read brings bytes after all, or a read brings more than was planned, the
///    difference is planned as soon as there is room. Where memory runs out before, `Revoke` ends
///    such streams.
///
/// Thus all streams together hold at most the budget and, for each slot, one message, or two if
/// the stream comes in parts. Safe from any thread.
class ReadPermits {
 public:
  using Clock = std::chrono::steady_clock;

  class Reader {
   public:
    virtual ~Reader() = default;
    /// The read that waits may begin. Called without a lock.
    virtual void ReadPermitted() = 0;
    /// Memory is exhausted: ends the stream, whose read goes on. Called without a lock.
    virtual void ReadRevoked(const absl::Status& status) = 0;
  };

  struct Read {
    const void* stream = nullptr;      ///< The same for all connections of one stream.
    std::uint64_t expected_bytes = 0;  ///< 0: unknown.
    const CallerAccount* caller = nullptr;
    std::string peer;  ///< As CallChannel::peer.
  };

  /// Bytes that the connection of a peer has received so far; nothing where this is unknown.
  using ReceivedBytes = std::function<std::optional<std::uint64_t>(const std::string& peer)>;

  ReadPermits(MemoryBudget& budget, const ReadTerms& terms);

  // Of a reader, which may hold a lock of its own and calls Serve once it has released it:

  /// Requests a permit for a reader that has nothing in flight. If false, ReadPermitted follows.
  bool Begin(const std::shared_ptr<Reader>& reader, Read read);
  /// As Begin, for a read that the budget has room for.
  void BeginNow(const std::shared_ptr<Reader>& reader, Read read);
  /// The read has brought `bytes`, which the budget counts already. Errors, each with a Violation:
  /// RESOURCE_EXHAUSTED (MEMORY_BUDGET, CALLER_BYTES) if the permit has lapsed, and there is no
  /// room for them.
  absl::Status Came(const Reader& reader, std::uint64_t bytes);
  /// The reader neither reads nor waits any more, and has nothing in flight. May be called again.
  void End(const Reader& reader);

  /// Lets reads begin for which there is room now. To be called without a lock.
  void Serve();

  // Of the thread that watches the memory of the process (IntakeGuard):

  /// Whether reads wait, or reads may bring more than the server has memory for.
  bool NeedsLook() const;
  /// Whether permits may lapse, or have lapsed.
  bool NeedsBytes() const { return waiting_ > 0 || lapsed_ > 0; }
  /// From now on `tell` is called when a read begins to wait or NeedsLook becomes true. It may be
  /// called with the lock of a reader held. Empty: nothing is called.
  void OnWaiting(std::function<void()> tell);
  /// Lets permits lapse, and plans what has come beyond them.
  void Look(Clock::time_point now, const ReceivedBytes& received);
  /// Memory is exhausted: of the reads that bring more than was planned, as many go on as can
  /// bring a largest message each into `free_bytes`, callers in turn. The streams of the others
  /// end. Returns their number.
  std::size_t Revoke(std::uint64_t free_bytes);

  const ReadTerms& terms() const { return terms_; }
  std::size_t waiting() const { return waiting_; }
  std::size_t streams_beyond() const;

 private:
  enum class State { kWaiting, kReading, kHolding };
  struct Permit {
    std::weak_ptr<Reader> reader;
    Read read;
    State state = State::kWaiting;
    std::uint64_t number = 0;   // Rises in the order in which reads were requested.
    std::uint64_t planned = 0;  // Bytes in the budget's plan.
    std::uint64_t beyond = 0;   // Bytes in its slot, planned or held.
    bool has_slot = false, has_lapsed = false;
    // Of its connection, since the first look at it.
    std::optional<std::uint64_t> received;
    std::uint64_t came = 0, grown = 0;  // In all, and between the last two looks.
    std::optional<Clock::time_point> moved;
  };
  using Permits = std::map<const Reader*, Permit>;
  // A stream that may have a frame beyond the budget.
  struct Slot {
    std::uint64_t bytes = 0;       // That came.
    bool reading = false;          // One of its connections.
    std::set<const Reader*> used;  // Connections that were read from.
    std::set<const Reader*> open;  // Those of them whose frame is not answered.
  };

  // With the lock held:
  std::uint64_t Expected(const Read& read) const;
  Permit& Renew(const std::shared_ptr<Reader>& reader, Read read);
  bool TryPermit(Permits::value_type& item, bool may_open_slot);
  Slot* FindSlot(const Permits::value_type& item, bool may_open_slot);
  void Unplan(Permit& permit);
  void SetBeyond(Permit& permit, std::uint64_t bytes);
  void Finish(Permits::value_type& item);
  void FreeSlots();
  void LeaveSlot(const Reader* reader, Permit& permit);
  std::shared_ptr<Reader> PermitNext();
  void Measure(Permit& permit, Clock::time_point now, const ReceivedBytes& received);
  void LapseOrCover(Permits::value_type& item, Clock::time_point now);
  bool IsAtRisk(const Permit& permit) const;
  // Without:
  void ServeWaiting();
  void TellWaiting() const;

  friend class MemoryBudget;

  MemoryBudget& budget_;
  const ReadTerms terms_;
  std::atomic<std::size_t> waiting_ = 0, reading_ = 0, lapsed_ = 0;
  std::atomic<bool> changed_ = false;  // Since the last Serve.

  mutable std::mutex mutex_;  // Guards everything below.
  Permits permits_;
  std::map<const void*, Slot> slots_;  // By stream.
  std::uint64_t numbers_ = 0;

  mutable std::mutex tell_mutex_;  // Guards what follows.
  std::function<void()> tell_waiting_;
};

}  // namespace partiemc::server
