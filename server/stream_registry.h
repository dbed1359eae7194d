// The streams of this server: who may come in, who is there, and how all are sent home.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
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
#include "server/stream_flow.h"
#include "server/watch_hub.h"

namespace partiemc::server {

/// The reasons for which a stream is not opened, beside those of the core (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonName = "NAME";
inline constexpr std::string_view kReasonNameInUse = "NAME_IN_USE";
inline constexpr std::string_view kReasonLabels = "LABELS";
inline constexpr std::string_view kReasonTooManyStreams = "TOO_MANY_STREAMS";
inline constexpr std::string_view kReasonNoSuchStream = "NO_SUCH_STREAM";

struct StreamDescription {
  std::string name;  ///< Empty: the registry makes one up.
  std::map<std::string, std::string> labels;
  ReconstructionParameters parameters;  ///< As resolved.
  std::shared_ptr<WatchHub> hub;        ///< Shows its results to watchers.
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
  explicit StreamRegistry(std::uint32_t max_streams);

  /// A flow comes in, not open yet. Errors: UNAVAILABLE (DRAINING); RESOURCE_EXHAUSTED
  /// (TOO_MANY_STREAMS) where as many as may be open are still opening.
  absl::Status Enter(std::shared_ptr<StreamFlow> flow);

  /// Opens the stream of a flow that has entered. Where an open stream has the same `token`, the
  /// new one takes over from it: its place, its name if none is given, and its flow ends.
  /// Errors, each with a Violation: INVALID_ARGUMENT (NAME, LABELS, STREAM_TOKEN), ALREADY_EXISTS
  /// (NAME_IN_USE), RESOURCE_EXHAUSTED (TOO_MANY_STREAMS), UNAVAILABLE (DRAINING).
  absl::StatusOr<StreamSummary> Open(const StreamFlow& flow, StreamDescription description,
                                     std::string token);

  /// The flow's stream ends: its name and its place are free. What it was, if it had been opened.
  std::optional<StreamSummary> Close(const StreamFlow& flow);
  /// The flow has gone: its last word has been sent.
  void Leave(const StreamFlow& flow);

  /// The open stream of that name. Errors: NOT_FOUND (NO_SUCH_STREAM).
  absl::StatusOr<StreamSummary> Find(const std::string& name) const;
  /// The open streams in the order of their numbers: at most `count`, with numbers above `after`.
  std::vector<StreamSummary> List(std::uint64_t after, std::size_t count) const;
  std::size_t OpenCount() const;

  /// Lets nobody in any more and drains every flow.
  void Drain();
  bool draining() const;
  /// OK, or, told to whoever comes now, UNAVAILABLE (DRAINING).
  absl::Status CheckServing();
  /// Who has been told so: grows for as long as somebody still comes.
  std::uint64_t turned_away() const;
  /// Ends the flows that have waited for their clients for too long. Gives the time before which
  /// none of those that are here now will have.
  std::chrono::steady_clock::time_point EndIdle(const IdleLimits& limits,
                                                std::chrono::steady_clock::time_point now);
  /// Whether all flows have left before the deadline.
  bool WaitUntilEmpty(std::chrono::steady_clock::time_point deadline);

 private:
  struct Entry {
    std::shared_ptr<StreamFlow> flow;
    bool opening = true;                  // Until it is open or closed.
    std::optional<StreamSummary> stream;  // While open; its counts are asked of the flow.
    std::string token;                    // Of the stream.
    bool taken_over = false;  // By another entry: the stream is not this one's any more.

    bool IsOpen() const { return stream && !taken_over; }
  };

  absl::Status TooMany(absl::string_view what, std::uint32_t count) const;
  // With the lock held:
  absl::Status CheckServingLocked();
  std::vector<std::shared_ptr<StreamFlow>> Flows() const;
  Entry* FindOpen(std::string_view token);

  const std::uint32_t max_streams_;
  const std::string id_prefix_;  // Tells the ids of one run of a server from those of another.

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable left_;
  std::map<const StreamFlow*, Entry> entries_;
  std::uint64_t opened_ = 0;
  std::uint32_t opening_ = 0;  // Entries that are.
  bool draining_ = false;
  std::uint64_t turned_away_ = 0;
};

}  // namespace partiemc::server
