// Counts the memory of a worker's buffers in the server's budget.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/compute/memory_budget.h"

namespace partiemc::server {

/// Bytes of each worker that do not count in the budget. A compact body of 200,000 particles needs
/// no more, so the server computes such frames even with a small budget.
inline constexpr std::uint64_t kWorkerBytes = std::uint64_t{16} << 20;

/// Usual upper bound of a worker's bytes per particle. A compact body needs a tenth of it, a
/// thousand islands with ids need all of it. Exception: isolated drops, each in its own tile, need
/// up to 100 times this value.
inline constexpr std::uint64_t kWorkerBytesPerParticle = 500;

/// A worker's usual bytes per byte of the frame's message. A particle of a compact body takes 8
/// bytes in the message (two float32) and 80 bytes in the worker.
inline constexpr std::uint64_t kUsualBytesPerMessageByte = 10;

/// Counts the memory of one worker. Its bytes above kWorkerBytes count in the budget until the
/// worker's buffers are freed. Used by one thread at a time.
class WorkerMemory {
 public:
  /// `budget` outlives this object. If it is null, every request is granted and nothing is counted.
  explicit WorkerMemory(MemoryBudget* budget = nullptr) : budget_(budget) {}
  ~WorkerMemory() { GiveBack(); }
  WorkerMemory(const WorkerMemory&) = delete;
  WorkerMemory& operator=(const WorkerMemory&) = delete;

  /// Reserves the memory that a frame with a message of this size usually needs. Blocks like
  /// MemoryBudget::TakeForWorker, which may take the memory beyond the budget.
  void BeginFrame(std::uint64_t message_bytes);
  /// Reserves memory so that all buffers together may grow to `bytes`, for a frame with this number
  /// of particles. Does not block; returns false if the memory is refused. The buffers may always
  /// use kWorkerBytes and the bytes reserved before. More is granted if MemoryBudget::TryTake or
  /// TryTakeBeyond grants it. TryTakeBeyond is tried only if `bytes` are at most kWorkerBytes plus
  /// `state_bytes` plus kWorkerBytesPerParticle for each particle.
  /// `state_bytes`: the part of `bytes` for states of the stream. Earlier frames determine their
  /// size.
  bool Reserve(std::uint64_t bytes, std::size_t particles, std::uint64_t state_bytes = 0);
  /// Gives back reserved bytes that no frame has used since the buffers were last freed.
  void EndFrame();

  /// Gives back all bytes. Requires: the buffers are freed.
  void GiveBack();

  /// Whether the budget counts bytes of this worker.
  bool counts() const { return counted_ > 0; }
  /// Whether the worker holds memory beyond the budget, which it must give back after the frame.
  bool is_beyond() const { return is_beyond_; }

 private:
  MemoryBudget* const budget_;
  std::uint64_t counted_ = 0;  // Bytes in the budget or beyond it.
  std::uint64_t used_ = 0;     // Largest size of the buffers since they were freed.
  bool is_beyond_ = false;
};

}  // namespace partiemc::server
