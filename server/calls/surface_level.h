// Makes levels of detail of the results for watchers.
#pragma once

#include <atomic>

#include "server/watch/level_queue.h"

namespace partiemc::server {

class MemoryBudget;

/// Simplifies the surface of `exact`, a WatchedResult of a stream of this server. The working
/// memory counts in `budget`, without queueing; if it does not fit now, `may_succeed_later` is set.
/// Errors, with a Violation: RESOURCE_EXHAUSTED (MEMORY_BUDGET); CANCELLED; INTERNAL.
LevelQueue::Made MakeResultLevel(const LevelQueue::Frame& exact, const LevelOfDetail& level,
                                 const std::atomic<bool>& cancelled, MemoryBudget& budget);

}  // namespace partiemc::server
