// What the buffers of a worker hold of the server's memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/compute/memory_budget.h"

namespace partiemc::server {

/// What every worker may hold outside of the budget: enough for frames of ordinary streams, so that
/// a small budget does not refuse them.
inline constexpr std::uint64_t kWorkerBytes = std::uint64_t{16} << 20;

/// What computing may take for each particle of a frame, room in the budget or not. A compact body
/// needs a tenth of it, a thousand islands with ids need all of it; drops that lie far apart, each
/// in tiles of its own, need a hundred times as much.
inline constexpr std::uint64_t kWorkerBytesPerParticle = 500;

/// The account of one worker. What it holds beyond kWorkerBytes counts in the budget, from the
/// frame that needed it until the worker's buffers are freed. Used by one thread at a time.
class WorkerMemory {
 public:
  /// `budget` outlives the account; none: everything is granted, and nothing counted.
  explicit WorkerMemory(MemoryBudget* budget = nullptr) : budget_(budget) {}
  ~WorkerMemory() { GiveBack(); }
  WorkerMemory(const WorkerMemory&) = delete;
  WorkerMemory& operator=(const WorkerMemory&) = delete;

  /// Whether the buffers may hold `bytes` in all for a frame of so many particles: up to
  /// kWorkerBytes and kWorkerBytesPerParticle for each they always may; more than that only where
  /// the budget has room, and nobody waits for it.
  bool Reserve(std::uint64_t bytes, std::size_t particles);

  /// The buffers were freed.
  void GiveBack();

  /// Whether it holds any of the budget.
  bool counts() const { return counted_ > 0; }

 private:
  MemoryBudget* const budget_;
  std::uint64_t counted_ = 0;  // In the budget.
};

}  // namespace partiemc::server
