// Makes levels of detail of the results for watchers.
#pragma once

#include <atomic>
#include <string_view>

#include "server/watch/level_queue.h"

namespace partiemc::server {

class MemoryBudget;

inline constexpr std::string_view kReasonInvalidResult = "INVALID_RESULT";

/// Simplifies the surface of `exact`, a WatchedResult. Returns `exact` if it has no surface. The
/// working memory counts in `budget`. If the memory does not fit now, but may fit later, sets
/// `may_succeed_later`. Memory and time are bounded for any bytes. Errors, with a Violation:
/// RESOURCE_EXHAUSTED (MEMORY_BUDGET); DATA_LOSS (INVALID_RESULT) if a result of another replica is
/// invalid. Without a Violation: INTERNAL if a result of this server is invalid; CANCELLED.
LevelQueue::Made MakeResultLevel(const LevelQueue::Frame& exact, const LevelOfDetail& level,
                                 const std::atomic<bool>& cancelled, MemoryBudget& budget);

}  // namespace partiemc::server
