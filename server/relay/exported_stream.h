// A stream of this replica that other replicas watch. Each result is published once for all of
// them; a replica fetches the results that it has missed.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/clock.h"
#include "server/relay/relay_port.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// A watcher of the stream in mode `every`, with the limits of a watcher. So a slow or disconnected
/// bus does not delay the producer. Public functions: relay thread only.
class ExportedStream final : public std::enable_shared_from_this<ExportedStream>,
                             private WatchTransport {
 public:
  using TimePoint = Clock::TimePoint;

  /// Requires: `port` and `clock` live until live() is false; held by shared_ptr.
  ExportedStream(std::string id, std::shared_ptr<ResultBroadcaster> broadcaster,
                 std::size_t max_bytes, RelayPort& port, const Clock& clock);

  /// Starts to publish new results.
  void Begin();
  /// Stops publishing.
  void End();
  /// Retries a failed send. Newer results wait as for a slow watcher.
  void Retry();
  /// True from Begin until the stream has ended or End has completed.
  bool live() const { return live_; }

  /// Sets the time until which another replica has requested results.
  void WantedUntil(TimePoint until) { wanted_until_ = until; }
  TimePoint wanted_until() const { return wanted_until_; }
  /// The time at which its end was published. The end is repeated for each later fetch.
  std::optional<TimePoint> ended_at() const { return ended_at_; }
  /// Responds to `fetch` of `replica`.
  void Answer(const relay::v1::Fetch& fetch, const std::string& replica);

 private:
  // The fetch to which a result responds; 0: a new result.
  struct Answering {
    std::uint64_t fetch = 0;
    bool first = false;
  };

  void StartRead() override;
  void StartOpen() override;
  void WriteOpened(const HeldFrames& held) override;
  void WriteFrame(const Published& published, std::uint64_t dropped,
                  std::uint64_t oldest_sequence) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void Cut() override {}
  void Finish(const absl::Status& status) override;

  void Try(std::function<bool()> send);
  bool PublishEnd(const WatchEnd& end, std::uint64_t dropped);
  bool SendResult(const std::string& subject, const Published& published,
                  const Answering& answering, std::uint64_t oldest_sequence);
  Published First(const relay::v1::Fetch& fetch) const;
  Published NextAfter(std::uint64_t number) const;

  const std::string id_;
  const std::shared_ptr<ResultBroadcaster> broadcaster_;
  RelayPort& port_;
  const Clock& clock_;
  const std::shared_ptr<WatchStateMachine> machine_;
  std::shared_ptr<ExportedStream> self_;  // Keeps this alive while live_: the machine calls it.
  std::atomic<bool> live_ = false, opened_ = false;
  TimePoint wanted_until_;
  std::uint64_t last_published_ = 0;  // Result number.
  std::function<bool()> unsent_;
  std::optional<TimePoint> ended_at_;
  relay::v1::RelayMessage end_;  // Set with ended_at_.
};

}  // namespace partiemc::server
