// A cgroup with a limit of memory, as a container has it.
#pragma once

#include <cstdint>
#include <string>

#include "service/server_process.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {

/// Removed when it goes out of scope; no process may be in it then.
class MemoryGroup {
 public:
  /// Makes a group of either version. Not available where this process may not make one.
  explicit MemoryGroup(std::uint64_t limit_bytes);
  ~MemoryGroup();
  MemoryGroup(const MemoryGroup&) = delete;
  MemoryGroup& operator=(const MemoryGroup&) = delete;

  bool available() const { return !folder_.empty(); }
  /// Starts the server in the group, if it is available.
  server::Surroundings Around() const;
  /// The most that the group has held, in MiB; 0 where the kernel does not report it.
  double PeakMib() const;

 private:
  bool Make(const std::string& folder, const std::string& limit_file, std::uint64_t limit_bytes);

  std::string folder_;     // Of the group; empty: not available.
  std::string peak_file_;  // In it.
  const support::TemporaryFolder scripts_;
};

}  // namespace partiemc::attack
