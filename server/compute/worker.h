// The buffers with which the compute threads compute frames.
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

/// Decides when a worker's buffers are oversized. Buffers grow to the size of the worker's largest
/// frame and keep it. They are oversized if, for `warm_time`, the worker computed no frame of at
/// least a quarter of that size.
class WarmSize {
 public:
  using Clock = std::chrono::steady_clock;

  void Used(std::size_t size, Clock::time_point now) {
    last_ = size;
    largest_ = std::max(largest_, size);
    if (size >= LeastFor(largest_)) needed_ = now;
  }
  /// Whether the buffers are oversized.
  bool Outlived(Clock::time_point now, Clock::duration warm_time) const {
    return largest_ > 0 && now - needed_ >= warm_time;
  }
  bool used() const { return largest_ > 0; }
  std::size_t largest() const { return largest_; }
  /// Returns the size of the last frame since the previous call of this method, or 0 if there was
  /// none.
  std::size_t TakeLast() { return std::exchange(last_, 0); }

  /// The smallest frame size that prevents buffers of size `largest` from being oversized.
  static std::size_t LeastFor(std::size_t largest) { return largest / 4; }

 private:
  std::size_t last_ = 0;
  std::size_t largest_ = 0;
  Clock::time_point needed_;
};

/// Buffers for parsing and writing messages. A class of server/calls derives from it, because the
/// compute rooms must not include messages.
class MessageBuffers {
 public:
  virtual ~MessageBuffers() = default;
};

/// The buffers for one frame at a time. They are reused from frame to frame, also for frames of
/// different streams and on different threads.
struct Worker {
  WorkerMemory memory;  ///< Counts the bytes of all buffers below.
  Workspace workspace;
  Result result;
  State next_state;  ///< The stream's state after the frame; copied to the stream on success.
  std::unique_ptr<MessageBuffers> message_buffers;
  WarmSize particles;  ///< Sizes of the computed frames, in particles.
  const WarmSize::Clock::time_point made = WarmSize::Clock::now();
  FrameObserver* observer = nullptr;  ///< Receives measurements of each frame; may be null.

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
