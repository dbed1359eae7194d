// Scheduling policies of a test's threads: attackers share the processors with the measured server.
#pragma once

#include <string>

namespace partiemc::attack {

/// From now on the calling thread runs only on idle processors (SCHED_IDLE). It may still run for
/// some milliseconds before a thread of usual priority that becomes ready.
void YieldProcessors();

/// From now on the calling thread, and all threads and processes that it starts, run before all
/// threads of usual priority (SCHED_RR). Returns the remedy if this process may not do so, else an
/// empty text.
std::string RunFirst();

}  // namespace partiemc::attack
