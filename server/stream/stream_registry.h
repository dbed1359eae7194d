// The streams of this server: admits, finds, lists and drains them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "common/mutex.h"
#include "partiemc/parameters.h"
#include "server/base/call_registry.h"
#include "server/security/caller.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {

/// Reasons for which a stream is refused, in addition to the core's reasons (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonName = "NAME";
inline constexpr std::string_view kReasonNameInUse = "NAME_IN_USE";
inline constexpr std::string_view kReasonLabels = "LABELS";
inline constexpr std::string_view kReasonTooManyStreams = "TOO_MANY_STREAMS";
inline constexpr std::string_view kReasonNoSuchStream = "NO_SUCH_STREAM";
/// Reasons for refusing a call that would send parts of another call's stream.
inline constexpr std::string_view kReasonPartsCount = "PARTS_COUNT";
inline constexpr std::string_view kReasonPartsToken = "PARTS_TOKEN";
inline constexpr std::string_view kReasonTooManyParts = "TOO_MANY_PARTS";
/// Reason for refusing a ListStreams request with an invalid page token.
inline constexpr std::string_view kReasonPageToken = "PAGE_TOKEN";

/// NOT_FOUND (NO_SUCH_STREAM): there is no open stream of this name.
absl::Status NoSuchStream(const std::string& name,
                          std::string rule =
                              "must be the name of an open stream; ListStreams "
                              "(`partiemc streams`) lists them");

struct StreamDescription {
  std::string name;  ///< Empty: the registry generates one.
  std::map<std::string, std::string> labels;
  ReconstructionParameters parameters;             ///< With defaults resolved.
  std::shared_ptr<ResultBroadcaster> broadcaster;  ///< Sends the results to watchers.
  std::uint64_t next_sequence = 1;                 ///< Sequence number of the first frame.
  std::shared_ptr<FrameAssembler> assembler = {};  ///< Null if frames arrive whole.
  std::string parts_token = {};                    ///< The secret that allows sending parts.
};

/// The request of a call that sends one part of each frame of a stream.
struct PartTerms {
  std::string stream_name;
  std::uint32_t part = 1;  ///< From 1 to `parts` - 1.
  std::uint32_t parts = 2;
  std::string token;
};

/// The registration of a call that sends one part of a stream's frames.
struct JoinedPart {
  std::shared_ptr<FrameAssembler> assembler;
  FrameAssembler::Seat seat;
  std::string stream_id;
  ReconstructionParameters parameters;  ///< The stream's.
};

struct StreamSummary {
  std::string id;
  std::string lineage;       ///< LineageOf the stream token.
  std::uint64_t number = 0;  ///< Streams are numbered from 1 in the order of their opening.
  StreamDescription description;
  StreamCounts counts;
  std::chrono::steady_clock::time_point opened;
};

struct StreamEntry : CallEntry<StreamStateMachine> {
  Caller caller;
  CallerAccount::Place place;           ///< Set while the stream is open.
  std::optional<StreamSummary> stream;  ///< Set from Open to Close; its `counts` are out of date.
  std::string token;                    ///< The stream token.
  bool taken_over = false;              ///< Whether another entry continues the stream.
  /// The name of the stream whose parts this call sends, and the number of the part. Empty name:
  /// the call sends no parts.
  std::string part_of;
  std::uint32_t part = 0;

  bool IsOpen() const { return stream && !taken_over; }
};

/// The life of a StreamStateMachine ("machine") in the registry: it enters; it opens a stream, or
/// joins a stream to send one of its parts; it closes; it leaves. Thread-safe.
class StreamRegistry : private CallRegistry<StreamStateMachine, StreamEntry> {
 public:
  /// `history`: the memory for the histories of all streams, which outlives the registry. Null:
  /// streams have no histories. `max_parts`: maximum number of calls that send parts 1 and above.
  explicit StreamRegistry(std::uint32_t max_streams, HistoryRoom* history = nullptr,
                          std::uint32_t max_parts = 256);

  /// Registers the state machine of a new call that has not sent its `open` yet. OpeningCalls
  /// limits the number of such calls.
  /// Errors: UNAVAILABLE (DRAINING).
  absl::Status Enter(std::shared_ptr<StreamStateMachine> machine, Caller caller = {})
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Opens the stream of a registered state machine. If an open stream has the same `token`, the
  /// new stream takes over its slot and history, and its name if `description` has none. The
  /// machine of the former stream ends.
  /// Errors, each with a Violation: INVALID_ARGUMENT (NAME, LABELS, STREAM_TOKEN),
  /// PERMISSION_DENIED (NOT_PERMITTED: the caller may not use the name), ALREADY_EXISTS
  /// (NAME_IN_USE), RESOURCE_EXHAUSTED (TOO_MANY_STREAMS, CALLER_STREAMS), UNAVAILABLE (DRAINING).
  absl::StatusOr<StreamSummary> Open(const StreamStateMachine& machine,
                                     StreamDescription description, std::string token)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Lets a registered state machine send one part of each frame of an open stream.
  /// Errors, each with a Violation: the errors of Find; FAILED_PRECONDITION (PARTS_COUNT: the
  /// stream's frames have another number of parts); PERMISSION_DENIED (PARTS_TOKEN);
  /// RESOURCE_EXHAUSTED (TOO_MANY_PARTS); the errors of FrameAssembler::Join.
  absl::StatusOr<JoinedPart> JoinPart(const StreamStateMachine& machine, const PartTerms& terms)
      ABSL_LOCKS_EXCLUDED(mutex_);

  /// Ends the stream of the state machine: frees its name and its slot, unless another call has
  /// taken them over. Returns the stream's summary; absent if the machine has opened no stream.
  std::optional<StreamSummary> Close(const StreamStateMachine& machine) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Removes the state machine. Called after the status of its call was sent.
  void Leave(const StreamStateMachine& machine) ABSL_LOCKS_EXCLUDED(mutex_);

  /// Returns the open stream of this name, for `caller` to watch.
  /// Errors: PERMISSION_DENIED (NOT_PERMITTED) if the caller may not use the name, whether or not
  /// the stream exists; NOT_FOUND (NO_SUCH_STREAM).
  absl::StatusOr<StreamSummary> Find(const std::string& name, const Caller& caller = {}) const
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns at most `count` open streams with a number above `after`, sorted by number. Includes
  /// only streams whose names `caller` may use.
  std::vector<StreamSummary> List(std::uint64_t after, std::size_t count,
                                  const Caller& caller = {}) const ABSL_LOCKS_EXCLUDED(mutex_);
  std::size_t OpenCount() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// A counter that increases whenever a stream is opened or closed.
  std::uint64_t changes() const { return changes_; }

  /// Sets the addresses of other servers, which this server sends to its clients when it drains.
  void SetElsewhere(std::vector<std::string> addresses) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Returns the addresses of SetElsewhere. Each call rotates the list by one, so that clients
  /// spread evenly over the servers.
  std::vector<std::string> TakeElsewhere() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Drains the present state machines one after the other in the order of their arrival, evenly
  /// distributed over the time `within`. Blocks for this time. New calls are still admitted.
  void SendAway(std::chrono::milliseconds within) ABSL_LOCKS_EXCLUDED(mutex_);
  /// Refuses new calls and drains every state machine.
  void Drain() ABSL_LOCKS_EXCLUDED(mutex_);
  bool draining() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// UNAVAILABLE (DRAINING) after Drain, otherwise OK.
  absl::Status CheckServing() ABSL_LOCKS_EXCLUDED(mutex_);
  /// Number of refusals by CheckServing, Enter and Open because of the drain. It grows while
  /// clients still arrive.
  std::uint64_t turned_away() const ABSL_LOCKS_EXCLUDED(mutex_);
  /// Ends the state machines whose clients exceed an idle limit at `now`. Returns the earliest time
  /// at which another machine may exceed a limit.
  std::chrono::steady_clock::time_point EndIdle(const IdleLimits& limits,
                                                std::chrono::steady_clock::time_point now)
      ABSL_LOCKS_EXCLUDED(mutex_);
  /// Sets the function that the registry calls when EndIdle must run earlier than the time it last
  /// returned, because a stream has been opened or joined. Empty: no call. `tell` must not call the
  /// registry.
  void OnEarlierLook(std::function<void()> tell) ABSL_LOCKS_EXCLUDED(mutex_);
  using CallRegistry::WaitUntilEmpty;

 private:
  // What Open handles without the lock: the machine of the former stream, to call TakenOver, which
  // may call Leave; and frames that the history does not take over, to free them.
  struct Replaced {
    std::shared_ptr<StreamStateMachine> machine;
    std::vector<Published> frames;
  };

  absl::StatusOr<StreamSummary> OpenLocked(const StreamStateMachine& machine,
                                           StreamDescription description, std::string token,
                                           Replaced& replaced)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckServingLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Returns an error if no slot is free or `name` is in use. Ignores the stream of `former`, which
  // is about to be replaced.
  absl::Status CheckPlace(const Entry* former, const std::string& name) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Moves the slot of `former` to `entry` if both have the same caller account. Otherwise takes a
  // new slot for the caller of `entry`.
  static absl::Status TakePlace(Entry& entry, Entry* former);
  Entry* FindOpen(std::string_view token) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status CheckPart(const StreamDescription& stream, const PartTerms& terms) const
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Lets `entry` send a part, unless `max_parts` other calls send parts. Does not count earlier
  // calls for the same part: Join ends them, or their stream has ended.
  absl::Status TakePart(Entry& entry, const PartTerms& terms) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  std::vector<Published> BeginHistory(const StreamDescription& description, const Entry* former)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::uint32_t max_streams_, max_parts_;
  HistoryRoom* const history_;
  const std::string id_prefix_;  // Random, so that ids differ between runs of a server.

  std::uint64_t opened_ ABSL_GUARDED_BY(mutex_) = 0;
  std::atomic<std::uint64_t> changes_ = 0;
  std::vector<std::string> elsewhere_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t turned_away_ ABSL_GUARDED_BY(mutex_) = 0;
  std::function<void()> tell_earlier_look_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace partiemc::server
