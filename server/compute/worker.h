// What a worker keeps warm from frame to frame, and for how long.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <memory>
#include <utility>

#include "partiemc/reconstructor.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "server/compute/worker_memory.h"
#include "server/telemetry/frame_observer.h"

namespace partiemc::server {

/// Tells when buffers have grown beyond what they are used for: nothing of at least a quarter of
/// the largest size that they have seen has come for a while, or nothing at all.
class WarmSize {
 public:
  using Clock = std::chrono::steady_clock;

  void Used(std::size_t size, Clock::time_point now) {
    last_ = size;
    largest_ = std::max(largest_, size);
    if (size >= LeastFor(largest_)) needed_ = now;
  }
  bool Outlived(Clock::time_point now, Clock::duration warm_time) const {
    return largest_ > 0 && now - needed_ >= warm_time;
  }
  bool used() const { return largest_ > 0; }
  std::size_t largest() const { return largest_; }
  /// Of the last use; 0 if there was none since this was asked.
  std::size_t TakeLast() { return std::exchange(last_, 0); }

  /// Of what is smaller, buffers for `largest` are too large.
  static std::size_t LeastFor(std::size_t largest) { return largest / 4; }

 private:
  std::size_t last_ = 0;
  std::size_t largest_ = 0;
  Clock::time_point needed_;
};

/// The buffers of whoever turns messages into frames and back; sessions know nothing of them.
class MessageBuffers {
 public:
  virtual ~MessageBuffers() = default;
};

/// What a worker keeps warm from frame to frame, whichever stream they belong to.
struct Worker {
  WorkerMemory memory;  ///< What all of these hold; given back once they are gone.
  Workspace workspace;
  Result result;
  State next_state;  ///< Copied to the stream once the frame has been answered.
  std::unique_ptr<MessageBuffers> message_buffers;
  WarmSize particles;  ///< Of the frames that it has worked on.
  const WarmSize::Clock::time_point made = WarmSize::Clock::now();
  FrameObserver* observer = nullptr;  ///< Told of each frame; none: nobody asks.

  explicit Worker(FrameObserver* told = nullptr, MemoryBudget* budget = nullptr)
      : memory(budget), observer(told) {}

  /// Frees all buffers.
  void Empty() {
    workspace = Workspace();
    result = Result();
    next_state = State();
    message_buffers.reset();
    particles = WarmSize();
    memory.GiveBack();
  }
};

}  // namespace partiemc::server
