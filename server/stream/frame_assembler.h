// Brings together the parts of frames that the ranks of a simulator send, each over a call of its
// own. Knows no messages and no threads of calls.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::server {

/// The reasons for which a frame or one of its parts is refused (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonPartsMissing = "PARTS_MISSING";
inline constexpr std::string_view kReasonPartLate = "PART_LATE";
inline constexpr std::string_view kReasonPartDuplicate = "PART_DUPLICATE";
inline constexpr std::string_view kReasonPartAhead = "PART_AHEAD";
inline constexpr std::string_view kReasonFrameBytes = "FRAME_BYTES";
/// And for which the call of a part ends.
inline constexpr std::string_view kReasonLeaderGone = "LEADER_GONE";

/// A part as its call holds it.
class PartBytes {
 public:
  virtual ~PartBytes() = default;
};

/// The call of a part, part 0 among them.
class AssemblyMember {
 public:
  virtual ~AssemblyMember() = default;
  /// What a frame or a part of this call waits for may have come.
  virtual void LookAgain() = 0;
  /// This call is not one of the assembly any more. OK: all frames were answered.
  virtual void LeftOut(const absl::Status& status) = 0;
};

/// The frames of one call of part 0. Part 0 itself stays with its call, and the others are only
/// referred to: they count in the memory budget for as long as their calls hold them, and are let
/// go of with their call. At most `window` frames are gathered at once, each of at most
/// `max_frame_bytes`. Safe from any thread. Members are called without the lock.
class FrameAssembler {
 public:
  using Clock = std::chrono::steady_clock;

  struct Terms {
    std::uint32_t parts = 1;
    std::size_t window = 1;                ///< Frames from the next to be answered on.
    std::uint64_t max_frame_bytes = 0;     ///< Of all parts of a frame but part 0.
    std::chrono::milliseconds timeout{0};  ///< From the first part that has come, 0 or another.
    bool has_checkpoints = false;          ///< Answers may bring them.
    std::uint64_t next_sequence = 1;       ///< Of the first frame.
  };
  /// The place of a call in it.
  struct Seat {
    std::uint32_t part = 0;
    std::uint64_t holder = 0;  ///< Tells it from others that have had the part.
  };

  /// Requires: at least one part and a window of at least one.
  explicit FrameAssembler(const Terms& terms);

  // For the call of part 0:

  void SetLeader(std::weak_ptr<AssemblyMember> leader);
  /// It has sent frame `sequence`, hence received the answers a window before it. Numbers that are
  /// out of the window say nothing.
  void LeaderSent(std::uint64_t sequence);
  /// Whether frame `sequence`, whose part 0 came at `since`, can be answered at `now`: all parts
  /// are there, or it is too late for them, or it is not the next one. The timeout begins with the
  /// first part that came.
  bool IsReady(std::uint64_t sequence, Clock::time_point since, Clock::time_point now) const;
  /// What parts 1 and on of the next frame hold.
  std::uint64_t BytesOfNext() const;
  /// Parts 1 and on of the next frame, which from now on is over: its parts come too late.
  /// Errors: DEADLINE_EXCEEDED (PARTS_MISSING) with the first few that have not come.
  absl::StatusOr<std::vector<std::shared_ptr<const PartBytes>>> Take();
  /// The frames below `next_sequence` are answered, the last of them with a checkpoint or without.
  /// Requires: not below what it was before.
  void Answered(std::uint64_t next_sequence, bool with_checkpoint);
  /// Has the other members look again. To be called after Answered.
  void TellMembers();
  /// No frame will be answered any more. Members whose part waits in vain leave with UNAVAILABLE
  /// (LEADER_GONE) where the status is an error.
  void End(const absl::Status& status);

  // For the calls of the other parts:

  /// A call sends `part` from now on; one that has sent it so far leaves with ABORTED (TAKEN_OVER),
  /// and its parts that are not taken yet come again. Errors: UNAVAILABLE (LEADER_GONE).
  /// Requires: 0 < part < parts.
  absl::StatusOr<Seat> Join(std::uint32_t part, std::weak_ptr<AssemblyMember> member);
  /// The call has ended: its parts that are not taken yet are gone. Another holder's stay.
  void Leave(const Seat& seat);
  /// Keeps a part of frame `sequence`, which came at `now`. Errors, each with a Violation, which
  /// leave all as it was: PART_LATE, PART_DUPLICATE, PART_AHEAD, FRAME_BYTES; CANCELLED, without,
  /// for a call that has left.
  absl::Status Offer(const Seat& seat, std::uint64_t sequence, std::uint64_t bytes,
                     std::shared_ptr<const PartBytes> part, Clock::time_point now);
  /// Drops a part that was offered, unless it is taken already.
  void Withdraw(const Seat& seat, std::uint64_t sequence);
  /// Whether a part of frame `sequence` waits for nothing any more. If part 0 has not come within
  /// the timeout after the first part, the frame is over at `now`: its parts are dropped, and
  /// part 0 comes too late.
  bool IsOver(std::uint64_t sequence, Clock::time_point now);
  /// OK where the frame of a part that was taken was answered. Errors: DEADLINE_EXCEEDED
  /// (PARTS_MISSING) where part 0 has not come in time, PART_LATE where it has ended without the
  /// frame.
  absl::Status OutcomeOf(std::uint64_t sequence) const;

  /// The first frame whose parts are still wanted.
  std::uint64_t next_wanted() const;
  /// Frames below it are never wanted again, also where part 0 is resumed.
  std::uint64_t resume_sequence() const;
  std::uint32_t parts() const { return terms_.parts; }
  std::chrono::milliseconds timeout() const { return terms_.timeout; }

 private:
  struct Gathered {
    std::vector<std::shared_ptr<const PartBytes>> parts;  // From part 1 on; null: not there.
    std::vector<std::uint64_t> bytes;                     // Of each.
    std::uint64_t all_bytes = 0;
    std::uint32_t count = 0;
    Clock::time_point since;  // The first part came.
    bool is_over = false;     // Part 0 has not come in time: the parts are gone.
  };
  struct Member {
    std::uint64_t holder = 0;  // 0: nobody.
    std::weak_ptr<AssemblyMember> call;
  };

  // With the lock held:
  absl::Status CheckOffer(std::uint32_t part, std::uint64_t sequence, std::uint64_t bytes) const;
  static void Drop(Gathered& frame, std::uint32_t part);
  void DropAll(std::uint32_t part);
  absl::Status Missing(const Gathered& frame, bool has_leader) const;
  std::vector<std::weak_ptr<AssemblyMember>> Calls() const;

  const Terms terms_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::weak_ptr<AssemblyMember> leader_;
  std::vector<Member> members_;  // From part 1 on.
  std::uint64_t holders_ = 0;
  std::map<std::uint64_t, Gathered> frames_;  // By sequence, from wanted_ on.
  std::uint64_t next_;                        // To be answered.
  std::uint64_t last_of_leader_ = 0;          // The last frame whose part 0 has come.
  std::uint64_t wanted_;                      // The first that is not taken: next_, or one more.
  std::deque<std::uint64_t> checkpoints_;     // Sent, perhaps not received.
  std::uint64_t resume_;
  bool ended_ = false;
};

}  // namespace partiemc::server
