// Determines the memory and the number of processors that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Returns the memory of the machine in bytes, or the lowest limit of this process's control group
/// and its parents if that is lower. `root` is the folder that contains proc and sys; "" is the
/// root folder. A missing or malformed file sets no limit. Without any limit returns 2^64 - 1.
std::uint64_t AvailableMemory(const std::string& root = "");

/// Returns the lower of `processors` and the lowest CPU quota of the control groups, rounded up; at
/// least 1. `root` and missing files: see AvailableMemory.
unsigned AvailableProcessors(unsigned processors, const std::string& root = "");

}  // namespace partiemc::server
