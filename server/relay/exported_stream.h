// A stream of this replica that other replicas watch. The relay publishes each result once for all
// of them. A replica that has missed results fetches them.
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

/// Keeps the history of the stream for later fetches, also after the end of the stream.
/// Watches the local stream in mode `every`, with the limits of an ordinary watcher. So a slow or
/// disconnected bus does not delay the producer. The public functions are called by the relay
/// thread only.
class ExportedStream final : public std::enable_shared_from_this<ExportedStream>,
                             private WatchTransport {
 public:
  using TimePoint = Clock::TimePoint;

  /// `max_bytes`: limit of the results that wait to be sent. Requires: `port` and `clock` live
  /// until live() is false; this object is held by shared_ptr.
  ExportedStream(std::string id, std::shared_ptr<ResultBroadcaster> broadcaster,
                 std::size_t max_bytes, RelayPort& port, const Clock& clock);
  ~ExportedStream() override;

  /// Starts to publish new results.
  void Begin();
  /// Stops publishing.
  void End();
  /// Repeats a send that has failed. Until the send succeeds, newer results wait, as for a slow
  /// watcher.
  void Retry();
  /// True from Begin until the watch has ended: with the stream, by End, or because it fell behind.
  bool live() const { return live_; }

  /// Sets the time until which another replica requests the stream's results.
  void WantedUntil(TimePoint until) { wanted_until_ = until; }
  TimePoint wanted_until() const { return wanted_until_; }
  /// The time at which the end of the stream was published; empty if it has not ended. The end is
  /// sent again in response to each later fetch.
  std::optional<TimePoint> ended_at() const { return ended_at_; }
  /// Sends the response to a `fetch` of `replica`: the held results that `fetch` requests, up to 4
  /// MiB or one larger result, then a FetchEnd, then the end of the stream if it has ended. Stops
  /// at the first send that fails.
  void Answer(const relay::v1::Fetch& fetch, const std::string& replica);

 private:
  struct Answering {
    std::uint64_t fetch = 0;  // Number of the fetch that a result answers; 0: none, a new result.
    bool first = false;       // Whether the result is the first one of this response.
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
