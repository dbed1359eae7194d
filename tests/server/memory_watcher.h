// A watcher in memory: the client's and the server's end of one watch, without gRPC. Requests and
// frames travel on a thread of their own, as they do in gRPC.
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

/// A frame that knows which one it is.
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
  /// Opens at once.
  MemoryWatcher(std::shared_ptr<ResultBroadcaster> broadcaster, WatchMode mode,
                std::uint64_t credit, std::size_t max_bytes,
                std::optional<std::uint64_t> from_sequence = std::nullopt);
  /// Cancels what goes on and waits for the end.
  ~MemoryWatcher() override;

  // The client's end.
  void Credit(std::uint64_t frames);
  void Cancel();
  /// What is written from here on is not taken: one write stays under way.
  void StopReading();
  /// Waits until it is told that it is in.
  void WaitUntilOpened();
  /// Of the answer to its `open`, once it is told that it is in.
  HeldFrames held() const;
  /// Waits until as many frames have come in all, or the watch has ended.
  void WaitForFrames(std::size_t count);
  /// Waits for the end.
  absl::Status status();

  std::vector<SeenFrame> seen() const;
  /// Of the last message, once the watch has ended with one.
  std::string end_reason() const;
  std::uint64_t end_dropped() const;
  /// Frames that came without credit for them; two writes at once throw.
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
