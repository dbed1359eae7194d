// A stream of another replica (the owner), imported for the watchers of this replica.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "common/clock.h"
#include "server/relay/finished_streams.h"
#include "server/relay/relay_port.h"
#include "server/relay/stream_directory.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {

/// Used by the relay thread only. Results keep the result numbers of the owner, so gaps are
/// detected. Missing results are fetched. Results that the owner's history no longer contains count
/// as dropped.
class ImportedStream {
 public:
  using TimePoint = Clock::TimePoint;
  /// Callback for Await. Called once: with OK when watchers can join the stream, or with the error.
  using Ready = std::function<void(const absl::Status& status)>;

  struct Limits {
    ResultBroadcaster::Limits broadcaster;
    /// Maximum bytes of results that arrived too early and wait for the results before them.
    std::size_t waiting_bytes = std::size_t{16} << 20;
    HistoryRoom* history = nullptr;       ///< Outlives this; null: no history for watchers.
    FinishedStreams* finished = nullptr;  ///< Outlives this.
  };

  /// Begins the import: fetches the history from `from_sequence`. Fetches only the newest result if
  /// `from_sequence` is absent or `limits` has no history.
  ImportedStream(RemoteStream stream, std::optional<std::uint64_t> from_sequence,
                 WatchDispatcher& dispatcher, const Limits& limits, RelayPort& port, TimePoint now);

  const RemoteStream& stream() const { return stream_; }
  const std::shared_ptr<ResultBroadcaster>& broadcaster() const { return broadcaster_; }
  bool ended() const { return ended_; }
  /// True if the stream can be deleted: it has no watcher and no pending join, and it has either
  /// ended or had no watcher for kLinger.
  bool IsIdle(TimePoint now) const;

  /// Whether this import suffices for a watcher that starts at `from_sequence` (absent: at the
  /// newest result): a second import could not supply earlier results. False after the end of the
  /// stream. Before the end, true if `limits` has no history.
  bool Covers(std::optional<std::uint64_t> from_sequence, TimePoint now) const;
  /// Calls `ready`, at once or later.
  void Await(Ready ready);

  void OnMessage(relay::v1::Result& result, TimePoint now);
  void OnMessage(const relay::v1::FetchEnd& end, TimePoint now);
  void OnMessage(const relay::v1::StreamEnd& end, TimePoint now);
  /// Fetches the results and the end of the stream that may have been lost on the bus.
  void FetchAgain(TimePoint now);
  /// The owner no longer responds, or no longer has the stream. Ends the stream without waiting for
  /// fetches: with the end that the owner reported, or with `otherwise` if it reported none.
  void Lost(const WatchEnd& otherwise, TimePoint now);
  /// Ends the stream.
  void End(const WatchEnd& end);
  /// Ends all pending joins with `status`.
  void Refuse(const absl::Status& status) { AnswerWaiting(status); }
  /// Handles the timeouts. Called every 50 ms. `connected`: whether the bus is connected.
  /// - Requests the owner's new results each second while the bus is connected. The owner publishes
  ///   new results only while such requests arrive.
  /// - Ends a fetch, which requests results already published, if no response arrives for two
  ///   seconds. Before watchers can join (Ready), the import then ends with an error. Afterwards,
  ///   the missing results count as dropped, and a fetch does not time out while the bus is
  ///   disconnected.
  void Tick(TimePoint now, bool connected);

 private:
  void Fetch(TimePoint now);
  void FetchFrom(std::uint64_t number, TimePoint now);
  void FetchEnded(std::uint64_t last_number, TimePoint now);
  void Deliver(Published published);
  void DeliverUpTo(std::uint64_t number);
  void DeliverWaiting(TimePoint now);
  void Fail(const absl::Status& status);
  void AnswerWaiting(const absl::Status& status);
  void SetOldest(std::uint64_t sequence);

  const RemoteStream stream_;
  const std::optional<std::uint64_t> from_sequence_;
  const Limits limits_;
  RelayPort& port_;
  const std::shared_ptr<ResultBroadcaster> broadcaster_;

  bool ready_ = false, ended_ = false;
  std::vector<Ready> await_;
  std::uint64_t next_number_ = 0;  // Number of the next result to deliver; 0: unknown.
  std::uint64_t delivered_ = 0;    // Number of the last delivered result; 0: none.
  std::uint64_t last_loss_ = 0;    // Published::last_loss of the last delivered result.
  std::map<std::uint64_t, Published> waiting_;
  std::size_t waiting_bytes_ = 0;
  relay::v1::Fetch fetch_;  // The latest fetch.
  bool fetching_ = false;
  std::optional<relay::v1::StreamEnd> end_;  // Reported by the owner; waits for missing results.
  TimePoint began_, heard_, wanted_, watched_;
};

}  // namespace partiemc::server
