// A cgroup with a memory limit, like a container.
#pragma once

#include <cstdint>
#include <string>

#include "service/server_process.h"
#include "support/temporary_folder.h"

namespace partiemc::attack {

/// Removed by the destructor; it must then contain no process.
class MemoryGroup {
 public:
  /// Creates a cgroup of version 1 or 2. Unavailable if this process lacks the permission.
  explicit MemoryGroup(std::uint64_t limit_bytes);
  ~MemoryGroup();
  MemoryGroup(const MemoryGroup&) = delete;
  MemoryGroup& operator=(const MemoryGroup&) = delete;

  bool available() const { return !folder_.empty(); }
  /// Environment that starts a server in the cgroup, if available.
  server::Surroundings Around() const;
  /// Maximum memory of the cgroup in MiB; 0 if the kernel does not report it.
  double PeakMib() const;

 private:
  bool Make(const std::string& folder, const std::string& limit_file, std::uint64_t limit_bytes);

  std::string folder_;     // Folder of the cgroup; empty: unavailable.
  std::string peak_file_;  // File with the maximum.
  const support::TemporaryFolder scripts_;
};

}  // namespace partiemc::attack
