// Counts the memory of a worker's buffers in the server's budget.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/compute/memory_budget.h"

namespace partiemc::server {

/// Bytes of each worker that do not count in the budget. Ordinary frames need no more than these,
/// so a small budget does not cause the server to refuse them.
inline constexpr std::uint64_t kWorkerBytes = std::uint64_t{16} << 20;

/// Upper bound of a worker's bytes per particle, with an exception. A compact body needs a tenth of
/// it, a thousand islands with ids need all of it. Isolated drops, each in its own tile, need up to
/// 100 times this value.
inline constexpr std::uint64_t kWorkerBytesPerParticle = 500;

/// A worker's usual bytes per byte of the frame's message. A particle of a compact body takes 8
/// bytes in the message (two float32) and 80 bytes in the worker.
inline constexpr std::uint64_t kUsualBytesPerMessageByte = 10;

/// Counts the memory of one worker. Its bytes above kWorkerBytes count in the budget until the
/// worker's buffers are freed. Used by one thread at a time.
class WorkerMemory {
 public:
  /// `budget` outlives the account. If it is null, every request is granted and nothing is counted.
  explicit WorkerMemory(MemoryBudget* budget = nullptr) : budget_(budget) {}
  ~WorkerMemory() { GiveBack(); }
  WorkerMemory(const WorkerMemory&) = delete;
  WorkerMemory& operator=(const WorkerMemory&) = delete;

  /// Reserves the memory that a frame usually needs if its message has this size. Blocks until this
  /// memory fits into the budget, or until no other worker computes beyond the budget. In the
  /// second case it is reserved beyond the budget, at most BeyondBudget::worker_bytes.
  void BeginFrame(std::uint64_t message_bytes);
  /// Whether all buffers together may grow to `bytes` for a frame with this number of particles.
  /// They may always use kWorkerBytes plus the bytes that BeginFrame has reserved. More is granted
  /// if it fits into the budget and no claim waits. Otherwise the worker may take memory beyond the
  /// budget if no other worker does, at most kWorkerBytesPerParticle per particle.
  bool Reserve(std::uint64_t bytes, std::size_t particles);
  /// Gives back reserved bytes that the frame did not use.
  void EndFrame();

  /// Gives back all bytes. Called after the buffers were freed.
  void GiveBack();

  /// Whether any bytes count in the budget.
  bool counts() const { return counted_ > 0; }
  /// Whether the worker holds memory beyond the budget. Its buffers are then freed after the frame.
  bool is_beyond() const { return is_beyond_; }

 private:
  MemoryBudget* const budget_;
  std::uint64_t counted_ = 0;  // Bytes in the budget or beyond it.
  std::uint64_t used_ = 0;     // Largest size of the buffers since they were freed.
  bool is_beyond_ = false;
};

}  // namespace partiemc::server
