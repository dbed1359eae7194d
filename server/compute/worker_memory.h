// What the buffers of a worker hold of the server's memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/compute/memory_budget.h"

namespace partiemc::server {

/// What every worker may hold outside of the budget: enough for frames of ordinary streams, so that
/// a small budget does not refuse them.
inline constexpr std::uint64_t kWorkerBytes = std::uint64_t{16} << 20;

/// What computing may take for each particle of a frame. A compact body needs a tenth of it, a
/// thousand islands with ids need all of it; drops that lie far apart, each in tiles of its own,
/// need a hundred times as much.
inline constexpr std::uint64_t kWorkerBytesPerParticle = 500;

/// What computing usually takes for each byte of a frame's message: 80 bytes for a particle of a
/// compact body, two float32.
inline constexpr std::uint64_t kUsualBytesPerMessageByte = 10;

/// The account of one worker. What it holds beyond kWorkerBytes counts in the budget, from the
/// frame that needed it until the worker's buffers are freed. Used by one thread at a time.
class WorkerMemory {
 public:
  /// `budget` outlives the account; none: everything is granted, and nothing counted.
  explicit WorkerMemory(MemoryBudget* budget = nullptr) : budget_(budget) {}
  ~WorkerMemory() { GiveBack(); }
  WorkerMemory(const WorkerMemory&) = delete;
  WorkerMemory& operator=(const WorkerMemory&) = delete;

  /// A frame whose message has so many bytes is about to be computed. Reserves what it usually
  /// needs. If the budget has no room for that, waits until no other worker computes beyond the
  /// budget, and reserves it there (BeyondBudget::worker_bytes).
  void BeginFrame(std::uint64_t message_bytes);
  /// Whether the buffers may hold `bytes` in all for a frame of so many particles: kWorkerBytes and
  /// what BeginFrame has reserved always; more where the budget has room, and nobody waits for it.
  /// Without room kWorkerBytesPerParticle for each particle are granted beyond the budget, to one
  /// worker at a time.
  bool Reserve(std::uint64_t bytes, std::size_t particles);
  /// The frame is computed: gives back what was reserved and not used.
  void EndFrame();

  /// The buffers were freed.
  void GiveBack();

  /// Whether it holds any of the budget.
  bool counts() const { return counted_ > 0; }
  /// Whether it holds some beyond the budget: to be given back once the frame is computed.
  bool is_beyond() const { return is_beyond_; }

 private:
  MemoryBudget* const budget_;
  std::uint64_t counted_ = 0;  // In the budget.
  std::uint64_t used_ = 0;     // At most, since the buffers were freed.
  bool is_beyond_ = false;
};

}  // namespace partiemc::server
