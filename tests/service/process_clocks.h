// Processor time of another process.
#pragma once

#include <sys/types.h>

#include <string>

namespace partiemc::server {

/// Of all its threads, including ended ones; negative after it has ended.
double ProcessCpuMs(pid_t process);

/// Of its threads that currently have this name.
double ThreadsCpuMs(pid_t process, const std::string& name);

}  // namespace partiemc::server
