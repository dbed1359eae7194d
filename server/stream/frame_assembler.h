// Assembles frames from the parts that the ranks of a simulator send, each over its own call. Knows
// no messages and no threads of calls.
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
/// Reason for the end of a part's call.
inline constexpr std::string_view kReasonLeaderGone = "LEADER_GONE";

/// The bytes of a part, shared with its call.
class PartBytes {
 public:
  virtual ~PartBytes() = default;
};

/// The call of a part, part 0 included. Called without a lock, by any thread.
class AssemblyMember {
 public:
  virtual ~AssemblyMember() = default;
  /// A frame or part of this call may be ready for its response.
  virtual void LookAgain() = 0;
  /// The assembler has removed this call. OK: all frames were answered.
  virtual void LeftOut(const absl::Status& status) = 0;
};

/// Assembles the frames of one call of part 0. Part 0 itself stays with its call. The other parts
/// are shared with their calls: they count in the memory budget while their call holds them, and
/// are dropped when it ends. Assembles at most `window` frames at once, each of at most
/// `max_frame_bytes`. Thread-safe. Calls members without its lock.
class FrameAssembler {
 public:
  using Clock = std::chrono::steady_clock;

  struct Terms {
    std::uint32_t parts = 1;
    std::size_t window = 1;                ///< Number of frames, from the next to be answered.
    std::uint64_t max_frame_bytes = 0;     ///< Limit for a frame without its part 0.
    std::chrono::milliseconds timeout{0};  ///< From the first part of a frame, of any rank.
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
  /// Part 0 of frame `sequence` has arrived, so the client has received the responses a window
  /// earlier. Ignores numbers outside the window.
  void LeaderSent(std::uint64_t sequence);
  /// Whether frame `sequence`, whose part 0 came at `since`, can be answered at `now`: it is
  /// complete, its timeout has passed, or it is not the next frame. The timeout starts with the
  /// first part, of any rank.
  bool IsReady(std::uint64_t sequence, Clock::time_point since, Clock::time_point now) const;
  /// Size of the next frame without its part 0.
  std::uint64_t BytesOfNext() const;
  /// Returns parts 1 and on of the next frame and closes it: its later parts are refused.
  /// Errors: DEADLINE_EXCEEDED (PARTS_MISSING) with the numbers of the first missing parts.
  absl::StatusOr<std::vector<std::shared_ptr<const PartBytes>>> Take();
  /// The frames below `next_sequence` were answered, the last one with or without a checkpoint.
  /// Requires: `next_sequence` never decreases.
  void Answered(std::uint64_t next_sequence, bool with_checkpoint);
  /// Calls LookAgain of the other members. Called after Answered.
  void TellMembers();
  /// No frame will be answered any more. If `status` is an error, members whose part still waits
  /// leave with UNAVAILABLE (LEADER_GONE).
  void End(const absl::Status& status);

  // For the calls of the other parts:

  /// The call of `member` sends `part` from now on. A former call of this part leaves with ABORTED
  /// (TAKEN_OVER), and its parts that were not taken are dropped: the new call sends them again.
  /// Errors: UNAVAILABLE (LEADER_GONE). Requires: 0 < part < parts.
  absl::StatusOr<Seat> Join(std::uint32_t part, std::weak_ptr<AssemblyMember> member);
  /// The call has ended: drops its parts that were not taken. No effect after a takeover.
  void Leave(const Seat& seat);
  /// Stores a part of frame `sequence`, which came at `now`. Errors, which change nothing:
  /// PART_LATE, PART_DUPLICATE, PART_AHEAD, FRAME_BYTES, each with a Violation; CANCELLED, without
  /// a Violation, if the call has left.
  absl::Status Offer(const Seat& seat, std::uint64_t sequence, std::uint64_t bytes,
                     std::shared_ptr<const PartBytes> part, Clock::time_point now);
  /// Drops a stored part, unless it was taken.
  void Withdraw(const Seat& seat, std::uint64_t sequence);
  /// Whether a part of frame `sequence` can be answered. If part 0 has not come by `now`, within
  /// the timeout after the first part, this closes the frame: drops its parts, and refuses part 0.
  bool IsOver(std::uint64_t sequence, Clock::time_point now);
  /// OK if the frame of a part was answered. Errors: DEADLINE_EXCEEDED (PARTS_MISSING) if part 0
  /// came too late, PART_LATE if part 0 has ended before this frame.
  absl::Status OutcomeOf(std::uint64_t sequence) const;

  /// The first frame that still accepts parts.
  std::uint64_t next_wanted() const;
  /// Frames below this number are never required again, even if part 0 is resumed.
  std::uint64_t resume_sequence() const;
  std::uint32_t parts() const { return terms_.parts; }
  std::chrono::milliseconds timeout() const { return terms_.timeout; }

 private:
  struct Gathered {
    std::vector<std::shared_ptr<const PartBytes>> parts;  // From part 1 on; null: missing.
    std::vector<std::uint64_t> bytes;                     // Sizes of `parts`.
    std::uint64_t all_bytes = 0;
    std::uint32_t count = 0;
    Clock::time_point since;  // The first part came.
    bool is_over = false;     // Part 0 came too late; the parts were dropped.
  };
  struct Member {
    std::uint64_t holder = 0;  // 0: none.
    std::weak_ptr<AssemblyMember> call;
  };

  std::uint32_t other_parts() const { return terms_.parts - 1; }
  absl::Status CheckOffer(std::uint32_t part, std::uint64_t sequence, std::uint64_t bytes) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  static void Drop(Gathered& frame, std::uint32_t part);
  void DropAll(std::uint32_t part) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Missing(const Gathered& frame, bool has_leader) const;
  std::vector<std::weak_ptr<AssemblyMember>> Calls() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Terms terms_;

  mutable Mutex mutex_;
  std::weak_ptr<AssemblyMember> leader_ ABSL_GUARDED_BY(mutex_);
  std::vector<Member> members_ ABSL_GUARDED_BY(mutex_);  // From part 1 on.
  std::uint64_t holders_ ABSL_GUARDED_BY(mutex_) = 0;
  // By sequence, from wanted_ on.
  std::map<std::uint64_t, Gathered> frames_ ABSL_GUARDED_BY(mutex_);
  // next_ is the next frame to be answered, wanted_ the first that was not taken: next_, or one
  // more. Part 0 of last_of_leader_ has come.
  std::uint64_t next_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t wanted_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t last_of_leader_ ABSL_GUARDED_BY(mutex_) = 0;
  // Sent in responses, perhaps not received.
  std::deque<std::uint64_t> checkpoints_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t resume_ ABSL_GUARDED_BY(mutex_);
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace partiemc::server
