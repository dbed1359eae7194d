// The streams of this server: who may come in, who is there, and how all are sent home.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/parameters.h"
#include "server/security/caller.h"
#include "server/stream/stream_state_machine.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {

/// The reasons for which a stream is not opened, beside those of the core (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonName = "NAME";
inline constexpr std::string_view kReasonNameInUse = "NAME_IN_USE";
inline constexpr std::string_view kReasonLabels = "LABELS";
inline constexpr std::string_view kReasonTooManyStreams = "TOO_MANY_STREAMS";
inline constexpr std::string_view kReasonNoSuchStream = "NO_SUCH_STREAM";
/// For which a call does not send parts of a stream.
inline constexpr std::string_view kReasonPartsCount = "PARTS_COUNT";
inline constexpr std::string_view kReasonPartsToken = "PARTS_TOKEN";
inline constexpr std::string_view kReasonTooManyParts = "TOO_MANY_PARTS";
/// Of a ListStreams that wants a page that is none.
inline constexpr std::string_view kReasonPageToken = "PAGE_TOKEN";

/// NOT_FOUND (NO_SUCH_STREAM) for who asks for a stream of this name.
absl::Status NoSuchStream(const std::string& name,
                          std::string rule =
                              "must be the name of an open stream; ListStreams "
                              "tells them");

struct StreamDescription {
  std::string name;  ///< Empty: the registry makes one up.
  std::map<std::string, std::string> labels;
  ReconstructionParameters parameters;             ///< As resolved.
  std::shared_ptr<ResultBroadcaster> broadcaster;  ///< Shows its results to watchers.
  std::uint64_t next_sequence = 1;                 ///< Of the first frame that will come.
  std::shared_ptr<FrameAssembler> assembler = {};  ///< Where frames come in parts.
  std::string parts_token = {};                    ///< What their senders show.
};

/// What a call says that sends a part of a stream's frames.
struct PartTerms {
  std::string stream_name;
  std::uint32_t part = 1;  ///< Below `parts`; not 0.
  std::uint32_t parts = 2;
  std::string token;
};

/// A part's place, in the assembler of its stream.
struct JoinedPart {
  std::shared_ptr<FrameAssembler> assembler;
  FrameAssembler::Seat seat;
  std::string stream_id;  ///< Of the stream, and its parameters.
  ReconstructionParameters parameters;
};

struct StreamSummary {
  std::string id;
  std::string lineage;       ///< LineageOf its token.
  std::uint64_t number = 0;  ///< 1 for the first stream that was opened, then one more each.
  StreamDescription description;
  StreamCounts counts;
  std::chrono::steady_clock::time_point opened;
};

/// Safe from any thread.
class StreamRegistry {
 public:
  /// Watchers of the streams can go back as far as `history`, which lives longer, has room; null:
  /// not at all. At most `max_parts` calls send parts of streams that others have opened.
  explicit StreamRegistry(std::uint32_t max_streams, HistoryRoom* history = nullptr,
                          std::uint32_t max_parts = 256);

  /// A call of `caller` comes in, not open yet: those are counted elsewhere (OpeningCalls).
  /// Errors: UNAVAILABLE (DRAINING).
  absl::Status Enter(std::shared_ptr<StreamStateMachine> machine, Caller caller = {});

  /// Opens the stream of a machine that has entered. Where an open stream has the same `token`, the
  /// new one takes over from it: its place, its name if none is given, its history, and its machine
  /// ends.
  /// Errors, each with a Violation: INVALID_ARGUMENT (NAME, LABELS, STREAM_TOKEN),
  /// PERMISSION_DENIED (NOT_PERMITTED: the name is not one of the caller's), ALREADY_EXISTS
  /// (NAME_IN_USE), RESOURCE_EXHAUSTED (TOO_MANY_STREAMS, CALLER_STREAMS), UNAVAILABLE (DRAINING).
  absl::StatusOr<StreamSummary> Open(const StreamStateMachine& machine,
                                     StreamDescription description, std::string token);

  /// A machine that has entered sends a part of the frames of a stream that is open.
  /// Errors, each with a Violation: those of Find; FAILED_PRECONDITION (PARTS_COUNT: the stream's
  /// frames come in another number of parts, or whole); PERMISSION_DENIED (PARTS_TOKEN);
  /// RESOURCE_EXHAUSTED (TOO_MANY_PARTS); those of FrameAssembler::Join.
  absl::StatusOr<JoinedPart> JoinPart(const StreamStateMachine& machine, const PartTerms& terms);

  /// The machine's stream ends: its name and its place are free. What it was, if it had been
  /// opened.
  std::optional<StreamSummary> Close(const StreamStateMachine& machine);
  /// The machine has gone: its last word has been sent.
  void Leave(const StreamStateMachine& machine);

  /// The open stream of that name, for `caller` to watch. Errors: PERMISSION_DENIED (NOT_PERMITTED)
  /// for a name that is not one of the caller's, whether there is such a stream or not; NOT_FOUND
  /// (NO_SUCH_STREAM).
  absl::StatusOr<StreamSummary> Find(const std::string& name, const Caller& caller = {}) const;
  /// Of the open streams those whose names `caller` may use, in the order of their numbers: at most
  /// `count`, with numbers above `after`.
  std::vector<StreamSummary> List(std::uint64_t after, std::size_t count,
                                  const Caller& caller = {}) const;
  std::size_t OpenCount() const;
  /// Has grown whenever other streams are open than before.
  std::uint64_t changes() const { return changes_; }

  /// Addresses of other servers that those who are sent away may go to; nobody is, unless told.
  void SetElsewhere(std::vector<std::string> addresses);
  /// Those, each time with another one at the front, so that not all go to the same.
  std::vector<std::string> TakeElsewhere();
  /// Drains the machines that are here now, one after the other within this time. Who comes
  /// meanwhile is let in.
  void SendAway(std::chrono::milliseconds within);
  /// Lets nobody in any more and drains every machine.
  void Drain();
  bool draining() const;
  /// OK, or, told to whoever comes now, UNAVAILABLE (DRAINING).
  absl::Status CheckServing();
  /// Who has been told so: grows for as long as somebody still comes.
  std::uint64_t turned_away() const;
  /// Ends the machines that have waited for their clients for too long. Gives the time before which
  /// none of those that are here now will have.
  std::chrono::steady_clock::time_point EndIdle(const IdleLimits& limits,
                                                std::chrono::steady_clock::time_point now);
  /// From now on `tell` is called whenever there is a stream that wants to be looked at before the
  /// last call of EndIdle said; empty: nobody is told. It must not call this.
  void OnEarlierLook(std::function<void()> tell);
  /// Whether all machines have left before the deadline.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);

 private:
  struct Entry {
    std::shared_ptr<StreamStateMachine> machine;
    Caller caller;
    CallerAccount::Place place;           // While open.
    std::optional<StreamSummary> stream;  // While open; its counts are asked of the machine.
    std::string token;                    // Of the stream.
    bool taken_over = false;  // By another entry: the stream is not this one's any more.
    bool sends_part = false;  // Of a stream that another entry has opened.

    bool IsOpen() const { return stream && !taken_over; }
  };

  // With the lock held:
  absl::Status CheckServingLocked();
  // Whether there is a place, that of `former` counted as free, and whether `name` is free.
  absl::Status CheckPlace(const Entry* former, const std::string& name) const;
  // Of the caller of `entry`, where `former` has none to pass on.
  static absl::Status TakePlace(Entry& entry, Entry* former);
  std::vector<std::shared_ptr<StreamStateMachine>> Machines() const;
  Entry* FindOpen(std::string_view token);
  absl::Status CheckPart(const StreamDescription& stream, const PartTerms& terms) const;
  void BeginHistory(const StreamDescription& description, const Entry* former);

  const std::uint32_t max_streams_, max_parts_;
  HistoryRoom* const history_;
  const std::string id_prefix_;  // Tells the ids of one run of a server from those of another.

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<const StreamStateMachine*, Entry> entries_;
  std::uint64_t opened_ = 0;
  std::atomic<std::uint64_t> changes_ = 0;
  std::vector<std::string> elsewhere_;
  bool draining_ = false;
  std::uint64_t turned_away_ = 0;
  std::function<void()> tell_earlier_look_;
};

}  // namespace partiemc::server
