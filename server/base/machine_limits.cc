#include "server/base/machine_limits.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "absl/strings/str_split.h"

namespace partiemc::server {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

// Returns the number at the beginning of a file; kUnlimited for the text "max" and for errors.
std::uint64_t NumberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

// Calls visit(folder) for the folders of a control group and of its parents, up to `top`.
template <typename Visit>
void ForEachFolder(const std::string& top, std::string group, Visit visit) {
  for (;;) {
    visit(top + group);
    const auto slash = group.rfind('/');
    if (slash == std::string::npos) return;
    group.resize(slash);
  }
}

// Calls visit(version, folder) for the control groups that limit this process by `controller`
// ("memory", "cpu"), and for their parents. A line of /proc/self/cgroup is "0::/a/b" for version 2,
// and "4:memory:/a/b" or "3:cpu,cpuacct:/" for version 1. Inside a container, version 1 names the
// groups as the host sees them, so their folders may be missing. `visit` receives them all the
// same. The top folder is always visited; there a container sees its own limits.
template <typename Visit>
void ForEachGroup(const std::string& root, std::string_view controller, Visit visit) {
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const auto first = line.find(':');
    const auto second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::vector<std::string> controllers =
        absl::StrSplit(line.substr(first + 1, second - first - 1), ',', absl::SkipEmpty());
    const std::string group = line.substr(second + 1);
    const std::string top = root + "/sys/fs/cgroup";
    if (controllers.empty()) {
      ForEachFolder(top, group, [&](const std::string& folder) { visit(2, folder); });
    } else if (std::ranges::find(controllers, controller) != controllers.end()) {
      ForEachFolder(top + "/" + std::string(controller), group,
                    [&](const std::string& folder) { visit(1, folder); });
    }
  }
}

// Returns the number of processors that a group may use: its processor time per period, divided by
// the period. Infinite without a limit.
double QuotaOf(int version, const std::string& folder) {
  double quota = -1, period = 0;
  if (version == 2) {
    // The file contains "QUOTA PERIOD" in microseconds: "150000 100000", or "max 100000".
    std::ifstream file(folder + "/cpu.max");
    if (!(file >> quota >> period)) return std::numeric_limits<double>::infinity();
  } else {
    std::ifstream(folder + "/cpu.cfs_quota_us") >> quota;
    std::ifstream(folder + "/cpu.cfs_period_us") >> period;
  }
  return quota > 0 && period > 0 ? quota / period : std::numeric_limits<double>::infinity();
}

std::uint64_t PhysicalMemory(const std::string& root) {
  std::ifstream file(root + "/proc/meminfo");
  std::string name;
  std::uint64_t kilobytes = 0;
  // The first line is "MemTotal:       16316412 kB".
  return file >> name >> kilobytes && name == "MemTotal:" ? kilobytes * 1024 : kUnlimited;
}

}  // namespace

std::uint64_t AvailableMemory(const std::string& root) {
  std::uint64_t memory = PhysicalMemory(root);
  ForEachGroup(root, "memory", [&](int version, const std::string& folder) {
    const char* const file = version == 2 ? "/memory.max" : "/memory.limit_in_bytes";
    memory = std::min(memory, NumberIn(folder + file));
  });
  return memory;
}

unsigned AvailableProcessors(unsigned processors, const std::string& root) {
  double available = std::max(processors, 1u);
  ForEachGroup(root, "cpu", [&](int version, const std::string& folder) {
    available = std::min(available, QuotaOf(version, folder));
  });
  return static_cast<unsigned>(std::ceil(available));
}

}  // namespace partiemc::server
