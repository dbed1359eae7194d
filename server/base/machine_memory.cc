#include "server/base/machine_memory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <string_view>

namespace partiemc::server {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

// The number that the file begins with; "max" is none.
std::uint64_t NumberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

// The least limit of a group and of those that it is in, up to the folder `top`.
std::uint64_t LimitOfGroup(const std::string& top, std::string group, std::string_view file) {
  std::uint64_t limit = kUnlimited;
  for (;;) {
    limit = std::min(limit, NumberIn(top + group + "/" + std::string(file)));
    const auto slash = group.rfind('/');
    if (slash == std::string::npos) return limit;
    group.resize(slash);
  }
}

std::uint64_t PhysicalMemory(const std::string& root) {
  std::ifstream file(root + "/proc/meminfo");
  std::string name;
  std::uint64_t kilobytes = 0;
  // "MemTotal:       16316412 kB" is the first line.
  return file >> name >> kilobytes && name == "MemTotal:" ? kilobytes * 1024 : kUnlimited;
}

}  // namespace

std::uint64_t AvailableMemory(const std::string& root) {
  std::uint64_t memory = PhysicalMemory(root);
  std::ifstream groups(root + "/proc/self/cgroup");
  // "0::/a/b" for version 2, "4:memory:/a/b" for version 1, whose groups inside of a container are
  // named as seen from outside: what is not there limits nothing, its top is looked at in any case.
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':');
    const auto second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string_view controllers =
        std::string_view(line).substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) {
      memory = std::min(memory, LimitOfGroup(root + "/sys/fs/cgroup", group, "memory.max"));
    } else if (controllers == "memory") {
      memory = std::min(
          memory, LimitOfGroup(root + "/sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
    }
  }
  return memory;
}

}  // namespace partiemc::server
