#include "attack/memory_group.h"

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

namespace partiemc::attack {

MemoryGroup::MemoryGroup(std::uint64_t limit_bytes) {
  const std::string name = "/partiemc-test-" + std::to_string(::getpid());
  if (Make("/sys/fs/cgroup" + name, "memory.max", limit_bytes)) {
    peak_file_ = "memory.peak";
  } else if (Make("/sys/fs/cgroup/memory" + name, "memory.limit_in_bytes", limit_bytes)) {
    peak_file_ = "memory.max_usage_in_bytes";
  }
}

bool MemoryGroup::Make(const std::string& folder, const std::string& limit_file,
                       std::uint64_t limit_bytes) {
  if (::mkdir(folder.c_str(), 0755) != 0) return false;
  const std::string path = folder + "/" + limit_file;
  // A folder without the kernel's files is not a cgroup.
  const bool is_group = std::filesystem::exists(path);
  if (is_group && (std::ofstream(path) << limit_bytes).flush().good()) {
    folder_ = folder;
    return true;
  }
  ::rmdir(folder.c_str());
  return false;
}

MemoryGroup::~MemoryGroup() {
  if (folder_.empty()) return;
  // The kernel releases an ended process a moment later.
  for (int attempt = 0; attempt < 200 && ::rmdir(folder_.c_str()) != 0; ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

server::Surroundings MemoryGroup::Around() const {
  if (folder_.empty()) return {};
  const std::string script = scripts_.Write("in-group", "#!/bin/sh\necho $$ > " + folder_ +
                                                            "/cgroup.procs || exit 99\nexec " +
                                                            server::ServerProgram() + " \"$@\"\n");
  ::chmod(script.c_str(), 0755);
  return {.program = script};
}

double MemoryGroup::PeakMib() const {
  if (folder_.empty()) return 0;
  double bytes = 0;
  std::ifstream(folder_ + "/" + peak_file_) >> bytes;
  return bytes / (1 << 20);
}

}  // namespace partiemc::attack
