// A stream of this replica that others watch: each result is published once for all of them, and
// what one of them has missed it may fetch.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/relay/relay_port.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// To the stream it is one more watcher of all frames: the same bounds hold for it, and a bus that
/// is slow or gone harms its producer as little. Everything public is for the relay's thread.
class ExportedStream final : public std::enable_shared_from_this<ExportedStream>,
                             private WatchTransport {
 public:
  using Clock = std::chrono::steady_clock;

  /// `port` lives until live() is false. Held by shared_ptr only.
  ExportedStream(std::string id, std::shared_ptr<ResultBroadcaster> broadcaster,
                 std::size_t max_bytes, RelayPort& port);

  /// Publishes from now on what comes.
  void Begin();
  /// Nobody wants it any more.
  void End();
  /// Sends what could not be sent so far; what comes after it waits meanwhile as for any watcher.
  void Retry();
  /// Between Begin and the end of the stream, or the last thing after End.
  bool live() const { return live_; }

  /// Another replica wants the results, until then.
  void WantedUntil(Clock::time_point until) { wanted_until_ = until; }
  Clock::time_point wanted_until() const { return wanted_until_; }
  /// When its end was told, if it was: for who was away, it is told again to each that asks.
  std::optional<Clock::time_point> ended_at() const { return ended_at_; }
  /// Answers `fetch` of this replica.
  void Answer(const relay::v1::Fetch& fetch, const std::string& replica);

 private:
  // Which fetch a result answers; 0: none.
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
  const std::shared_ptr<WatchStateMachine> machine_;
  std::shared_ptr<ExportedStream> self_;  // While live: the machine calls it.
  std::atomic<bool> live_ = false, opened_ = false;
  Clock::time_point wanted_until_;
  std::uint64_t last_published_ = 0;  // Its number.
  std::function<bool()> unsent_;
  std::optional<Clock::time_point> ended_at_;
  relay::v1::RelayMessage end_;  // From then on.
};

}  // namespace partiemc::server
