// Memory and processors that this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Memory of the machine, or of this process's control group if that is less. `root` contains proc
/// and sys. Missing or malformed files set no limit.
std::uint64_t AvailableMemory(const std::string& root = "");

/// The lesser of `processors` and the control group's quota, rounded up; at least 1. `root` and
/// files as above.
unsigned AvailableProcessors(unsigned processors, const std::string& root = "");

}  // namespace partiemc::server
