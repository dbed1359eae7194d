// A stream of another replica, as watchers of this one see it.
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
#include "server/relay/relay_port.h"
#include "server/relay/stream_directory.h"
#include "server/watch/result_broadcaster.h"

namespace partiemc::server {

/// For the relay's thread alone. Results keep the numbers that their replica gave them, so that a
/// hole is seen: what is missing is fetched, and what cannot be had counts as dropped.
class ImportedStream {
 public:
  using Clock = std::chrono::steady_clock;
  /// Told once it can be joined, or why not.
  using Ready = std::function<void(const absl::Status& status)>;

  struct Limits {
    ResultBroadcaster::Limits broadcaster;
    /// Of results that wait for others before them.
    std::size_t waiting_bytes = std::size_t{16} << 20;
    HistoryRoom* history = nullptr;  ///< Lives longer; null: watchers cannot go back.
  };

  /// Fetches what is held from `from_sequence` on, or the newest result.
  ImportedStream(RemoteStream stream, std::optional<std::uint64_t> from_sequence,
                 WatchDispatcher& dispatcher, const Limits& limits, RelayPort& port,
                 Clock::time_point now);

  const RemoteStream& stream() const { return stream_; }
  const std::shared_ptr<ResultBroadcaster>& broadcaster() const { return broadcaster_; }
  bool ended() const { return ended_; }
  /// Of no use to anybody any more.
  bool IsIdle(Clock::time_point now) const;

  /// Whether who wants to watch from there sees as much here as at the replica that has it.
  bool Covers(std::optional<std::uint64_t> from_sequence, Clock::time_point now) const;
  void Await(Ready ready);

  void Came(relay::v1::Result& result, Clock::time_point now);
  void Came(const relay::v1::FetchEnd& end, Clock::time_point now);
  void Came(const relay::v1::StreamEnd& end, Clock::time_point now);
  /// What has come meanwhile may be missing, the end too: asks for it.
  void FetchAgain(Clock::time_point now);
  /// Its replica answers no more. Ends as the replica has told if it has, else with `otherwise`.
  void Lost(const WatchEnd& otherwise, Clock::time_point now);
  /// No more comes.
  void End(const WatchEnd& end);
  /// Who waits to join is told this instead.
  void Refuse(const absl::Status& status) { TellWaiting(status); }
  /// To be called every now and then.
  void Tick(Clock::time_point now, bool connected);

 private:
  void Fetch(Clock::time_point now);
  void FetchFrom(std::uint64_t number, Clock::time_point now);
  void FetchEnded(std::uint64_t last_number, Clock::time_point now);
  void Deliver(Published published);
  void DeliverUpTo(std::uint64_t number);
  void DeliverWaiting(Clock::time_point now);
  void Fail(const absl::Status& status);
  void TellWaiting(const absl::Status& status);
  void SetOldest(std::uint64_t sequence);

  const RemoteStream stream_;
  const std::optional<std::uint64_t> from_sequence_;
  const Limits limits_;
  RelayPort& port_;
  const std::shared_ptr<ResultBroadcaster> broadcaster_;

  bool ready_ = false, ended_ = false;
  std::vector<Ready> await_;
  std::uint64_t next_number_ = 0;  // To be delivered; 0: not known yet.
  std::map<std::uint64_t, Published> waiting_;
  std::size_t waiting_bytes_ = 0;
  relay::v1::Fetch fetch_;  // The last one.
  bool fetching_ = false;
  std::optional<relay::v1::StreamEnd> end_;  // To be told once all is delivered.
  Clock::time_point began_, heard_, wanted_, watched_;
};

}  // namespace partiemc::server
