// Processor time of another process, from outside.
#pragma once

#include <sys/types.h>

#include <string>

namespace partiemc::server {

/// Of all its threads, those that have ended included; negative once it has gone.
double ProcessCpuMs(pid_t process);

/// Of those of its threads that have this name now.
double ThreadsCpuMs(pid_t process, const std::string& name);

}  // namespace partiemc::server
