#include "attack/processor_share.h"

#include <sched.h>

#include <cerrno>
#include <system_error>

namespace partiemc::attack {

void YieldProcessors() {
  const sched_param parameters{};
  sched_setscheduler(0, SCHED_IDLE, &parameters);  // 0: the calling thread.
}

std::string RunFirst() {
  sched_param parameters{};
  parameters.sched_priority = sched_get_priority_min(SCHED_RR);
  if (sched_setscheduler(0, SCHED_RR, &parameters) == 0) return {};
  return "this process may not use SCHED_RR (" + std::generic_category().message(errno) +
         "): run it as root, with CAP_SYS_NICE, or with a limit of real-time priorities above 0 "
         "(ulimit -r)";
}

}  // namespace partiemc::attack
