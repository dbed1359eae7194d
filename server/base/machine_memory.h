// How much memory this process may use.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Of the machine, or of the control group that this process runs in where that has less. `root` is
/// the folder that proc and sys are in. Files that are missing or make no sense limit nothing.
std::uint64_t AvailableMemory(const std::string& root = "");

}  // namespace partiemc::server
