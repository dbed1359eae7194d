// Makes levels of detail of the results for watchers.
#pragma once

#include <atomic>
#include <string_view>

#include "server/watch/level_queue.h"

namespace partiemc::server {

class MemoryBudget;

inline constexpr std::string_view kReasonInvalidResult = "INVALID_RESULT";

/// Simplifies the surface of `exact`, a WatchedResult. The working memory counts in `budget`,
/// without queueing; if it does not fit now, `may_succeed_later` is set. Memory and time are
/// bounded for any bytes. Errors, with a Violation: RESOURCE_EXHAUSTED (MEMORY_BUDGET); DATA_LOSS
/// (INVALID_RESULT) if the result came from another replica and is no valid surface. CANCELLED;
/// INTERNAL for other results.
LevelQueue::Made MakeResultLevel(const LevelQueue::Frame& exact, const LevelOfDetail& level,
                                 const std::atomic<bool>& cancelled, MemoryBudget& budget);

}  // namespace partiemc::server
