// Assembles frames from the parts that the ranks of a simulator send, each over its own call.
// Independent of messages and of the threads of calls.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"

namespace partiemc::server {

/// Reasons of refused frames and parts (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonPartsMissing = "PARTS_MISSING";
inline constexpr std::string_view kReasonPartLate = "PART_LATE";
inline constexpr std::string_view kReasonPartDuplicate = "PART_DUPLICATE";
inline constexpr std::string_view kReasonPartAhead = "PART_AHEAD";
inline constexpr std::string_view kReasonFrameBytes = "FRAME_BYTES";
/// Reason with which the call of a part ends when the call of part 0 (the leader) has ended.
inline constexpr std::string_view kReasonLeaderGone = "LEADER_GONE";

/// The bytes of a part. The assembler shares them with the call that received them.
class PartBytes {
 public:
  virtual ~PartBytes() = default;
};

/// The interface to the call that sends one part (part 0 included). The assembler calls it from any
/// thread and holds no lock.
class AssemblyMember {
 public:
  virtual ~AssemblyMember() = default;
  /// A frame of part 0, or a part, may be ready for its response: the call should check again.
  virtual void LookAgain() = 0;
  /// The assembler has removed this call. `status`: UNAVAILABLE (LEADER_GONE) or OK if the call of
  /// part 0 has ended; ABORTED (TAKEN_OVER) if another call sends this part now. After the end of
  /// part 0's call, the parts of frames without a response are refused (OutcomeOf).
  virtual void LeftOut(const absl::Status& status) = 0;
};

/// Assembles the frames of one stream. The call of part 0 (the leader) owns the stream and keeps
/// its own part. The assembler shares the other parts with their calls. Such a part counts in the
/// memory budget while its call holds it, and is dropped when its call ends. At most `window`
/// frames are assembled at once, each of at most `max_frame_bytes`. Thread-safe. Calls members
/// without holding its lock.
class FrameAssembler {
 public:
  using Clock = std::chrono::steady_clock;

  struct Terms {
    std::uint32_t parts = 1;
    std::size_t window = 1;                ///< Maximum number of frames assembled at once.
    std::uint64_t max_frame_bytes = 0;     ///< Limit of parts 1 and above of a frame together.
    std::chrono::milliseconds timeout{0};  ///< From the first part of a frame to the last.
    bool has_checkpoints = false;          ///< Responses may have checkpoints.
    std::uint64_t next_sequence = 1;       ///< Number of the first frame.
  };
  /// Identifies the call that sends a part.
  struct Seat {
    std::uint32_t part = 0;
    std::uint64_t holder = 0;  ///< Differs between successive calls of one part.
  };

  /// Requires: at least one part and a window of at least one.
  explicit FrameAssembler(const Terms& terms);

  // For the call of part 0:

  void SetLeader(std::weak_ptr<AssemblyMember> leader);
  /// Part 0 of frame `sequence` has arrived. So the client has received the responses to all frames
  /// up to `sequence` - `window`, because it sends at most `window` frames ahead. Ignores numbers
  /// outside the window.
  void LeaderSent(std::uint64_t sequence);
  /// Whether the server can respond to frame `sequence`, whose part 0 arrived at `since`. True if
  /// the frame is complete, has failed (IsOver), has passed its timeout by `now`, or is not the
  /// next frame (and is refused). The timeout starts when the first part of the frame arrives, from
  /// any rank.
  bool IsReady(std::uint64_t sequence, Clock::time_point since, Clock::time_point now) const;
  /// Size of the next frame without part 0, in bytes.
  std::uint64_t BytesOfNext() const;
  /// Returns parts 1 and above of the next frame and closes the frame: parts of it that arrive
  /// later are refused.
  /// Errors: DEADLINE_EXCEEDED (PARTS_MISSING) with the numbers of the first missing parts.
  absl::StatusOr<std::vector<std::shared_ptr<const PartBytes>>> Take();
  /// Records that the server has responded to all frames below `next_sequence`. `with_checkpoint`:
  /// the last response contained a checkpoint.
  /// Requires: `next_sequence` never decreases.
  void Answered(std::uint64_t next_sequence, bool with_checkpoint);
  /// Calls LookAgain for each call of the parts 1 and above. The call of part 0 calls this after
  /// Answered, once the write of its response has started or was queued.
  void TellMembers();
  /// The call of part 0 ends, so no further frame gets a response. Removes the other calls: with OK
  /// if `status` is OK, otherwise with UNAVAILABLE (LEADER_GONE).
  void End(const absl::Status& status);

  // For the calls of the other parts:

  /// Registers the call of `member` as the sender of `part`. An earlier call that sent this part is
  /// removed with ABORTED (TAKEN_OVER). Its parts are dropped unless Take has returned them; the
  /// new call sends them again.
  /// Errors: UNAVAILABLE (LEADER_GONE). Requires: 0 < part < parts.
  absl::StatusOr<Seat> Join(std::uint32_t part, std::weak_ptr<AssemblyMember> member);
  /// The call has ended. Drops its parts unless Take has returned them. No effect if another call
  /// has taken over the part.
  void Leave(const Seat& seat);
  /// Stores a part of frame `sequence` that arrived at `now`.
  /// Errors, which change nothing: PART_LATE, PART_DUPLICATE, PART_AHEAD, FRAME_BYTES, each with a
  /// Violation; CANCELLED, without a Violation, if the call has left or another one has taken over
  /// the part.
  absl::Status Offer(const Seat& seat, std::uint64_t sequence, std::uint64_t bytes,
                     std::shared_ptr<const PartBytes> part, Clock::time_point now);
  /// Drops a stored part, unless Take has returned it.
  void Withdraw(const Seat& seat, std::uint64_t sequence);
  /// Whether the server can respond to the parts of frame `sequence`: the frame was answered or has
  /// failed, or the call of part 0 has ended. If part 0 has not arrived within the timeout after
  /// the first part, the frame fails now: this function drops its parts, and part 0 will be
  /// refused.
  bool IsOver(std::uint64_t sequence, Clock::time_point now);
  /// The outcome of a frame for the sender of a part. OK: the frame was answered, perhaps by an
  /// error.
  /// Errors: DEADLINE_EXCEEDED (PARTS_MISSING) if part 0 arrived too late, PART_LATE if the call of
  /// part 0 ended before this frame.
  absl::Status OutcomeOf(std::uint64_t sequence) const;

  /// The first frame that still accepts parts.
  std::uint64_t next_wanted() const;
  /// Clients never need to send frames below this number again, even if the call of part 0 resumes
  /// from a checkpoint.
  std::uint64_t resume_sequence() const;
  std::uint32_t parts() const { return terms_.parts; }
  std::chrono::milliseconds timeout() const { return terms_.timeout; }

 private:
  struct Gathered {
    std::vector<std::shared_ptr<const PartBytes>> parts;  // From part 1 on; null: missing.
    std::vector<std::uint64_t> bytes;                     // Sizes of `parts`.
    std::vector<Clock::time_point> arrivals;              // Arrivals of `parts`.
    std::uint64_t all_bytes = 0;
    std::uint32_t count = 0;
    Clock::time_point since;  // Arrival of the first part that is held.
    bool is_over = false;     // Part 0 came too late; the parts were dropped.
  };
  struct Member {
    std::uint64_t holder = 0;  // 0: none.
    std::weak_ptr<AssemblyMember> call;
  };

  using Frames = std::map<std::uint64_t, Gathered>;

  std::uint32_t other_parts() const { return terms_.parts - 1; }
  absl::Status CheckOffer(std::uint32_t part, std::uint64_t sequence, std::uint64_t bytes) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static void Drop(Gathered& frame, std::uint32_t part);
  // Removes a part, which its call may send again, from the frame `found`. Then erases the frame if
  // it has no part left and has not failed. Returns the next frame.
  Frames::iterator Withdraw(Frames::iterator found, std::uint32_t part)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void DropAll(std::uint32_t part) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Missing(const Gathered& frame, bool has_leader) const;
  std::vector<std::weak_ptr<AssemblyMember>> Calls() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Terms terms_;

  mutable Mutex mutex_;
  std::weak_ptr<AssemblyMember> leader_ ABSL_GUARDED_BY(mutex_);
  std::vector<Member> members_ ABSL_GUARDED_BY(mutex_);  // From part 1 on.
  std::uint64_t holders_ ABSL_GUARDED_BY(mutex_) = 0;
  // By sequence, from wanted_ on.
  Frames frames_ ABSL_GUARDED_BY(mutex_);
  // next_ is the next frame to be answered. wanted_ is the first frame that Take has not closed:
  // next_, or next_ + 1 while frame next_ is being computed. last_of_leader_ is the highest frame
  // whose part 0 has arrived.
  std::uint64_t next_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t wanted_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t last_of_leader_ ABSL_GUARDED_BY(mutex_) = 0;
  // Frames whose responses contained a checkpoint; the client may not have received these
  // responses.
  std::deque<std::uint64_t> checkpoints_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t resume_ ABSL_GUARDED_BY(mutex_);
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace partiemc::server
