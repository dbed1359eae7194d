// Determines the memory and the number of processors that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Memory of the machine, or the limit of this process's control group if that is lower. `root` is
/// the folder that contains proc and sys. Missing or malformed files set no limit.
std::uint64_t AvailableMemory(const std::string& root = "");

/// The lower of `processors` and the control group's CPU quota, rounded up; at least 1. `root` and
/// missing files: see AvailableMemory.
unsigned AvailableProcessors(unsigned processors, const std::string& root = "");

}  // namespace partiemc::server
