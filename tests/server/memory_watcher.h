// An in-memory watcher: both ends of one watch, without gRPC. As in gRPC, requests and frames
// travel on their own threads.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "server/watch/result_broadcaster.h"
#include "server/watch/watch_state_machine.h"

namespace partiemc::server {

/// A frame with its number.
class NumberedFrame final : public WatchFrame {
 public:
  NumberedFrame(std::uint64_t frame_number, std::size_t bytes)
      : WatchFrame(bytes), number(frame_number) {}
  const std::uint64_t number;
};

struct SeenFrame {
  std::uint64_t number = 0, dropped = 0;

  friend bool operator==(const SeenFrame&, const SeenFrame&) = default;
};

class MemoryWatcher final : private WatchTransport {
 public:
  /// Opens immediately.
  MemoryWatcher(std::shared_ptr<ResultBroadcaster> broadcaster, WatchMode mode,
                std::uint64_t credit, std::size_t max_bytes,
                std::optional<std::uint64_t> from_sequence = std::nullopt);
  /// Cancels the watch and waits for the end.
  ~MemoryWatcher() override;

  // The client's end.
  void Credit(std::uint64_t frames);
  void Cancel();
  /// Stops accepting writes: one write stays in progress.
  void StopReading();
  /// Waits for `opened`.
  void WaitUntilOpened();
  /// The history range in `opened`; requires that it has arrived.
  HeldFrames held() const;
  /// Waits until `count` frames have arrived in total, or the watch has ended.
  void WaitForFrames(std::size_t count);
  /// Waits for the end.
  absl::Status status();

  /// Whether a write is in progress.
  bool writes() const;
  std::vector<SeenFrame> seen() const;
  /// Reason in the last message of an ended watch; empty if there is none.
  std::string end_reason() const;
  std::uint64_t end_dropped() const;
  /// Frames received without credit. Two concurrent writes throw.
  std::uint64_t unpaid() const;

  WatchStateMachine& machine() { return *machine_; }

 private:
  void StartRead() override;
  void StartOpen() override { machine_->Opened(terms_); }
  void WriteOpened(const HeldFrames& held) override;
  void WriteFrame(const Published& published, std::uint64_t dropped,
                  std::uint64_t oldest_sequence) override;
  void WriteEnded(const WatchEnd& end, std::uint64_t dropped) override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  void BeginWrite();
  void Run();

  const WatchTerms terms_;
  std::shared_ptr<WatchStateMachine> machine_;

  mutable std::mutex mutex_;  // Guards everything below.
  std::condition_variable changed_;
  std::deque<WatchRequest> sent_;
  std::vector<SeenFrame> seen_;
  std::string end_reason_;
  std::uint64_t end_dropped_ = 0, paid_ = 0, unpaid_ = 0;
  HeldFrames held_;
  bool opened_ = false, reading_ = false, writing_ = false, taking_ = true, cut_ = false;
  std::optional<absl::Status> finished_;
  std::thread thread_;
};

}  // namespace partiemc::server
