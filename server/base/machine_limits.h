// How much of the machine this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Of the machine, or of the control group that this process runs in where that has less. `root` is
/// the folder that proc and sys are in. Files that are missing or make no sense limit nothing.
std::uint64_t AvailableMemory(const std::string& root = "");

/// Processors whose time it may use, at most `processors`: the quota of its control group, rounded
/// up, where that is less; at least one. `root` and files as above.
unsigned AvailableProcessors(unsigned processors, const std::string& root = "");

}  // namespace partiemc::server
