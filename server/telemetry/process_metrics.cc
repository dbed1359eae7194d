#include "server/telemetry/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <system_error>

namespace partiemc::server {
namespace {

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double CpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
}

// Returns a metric family that contains one gauge without labels.
prometheus::MetricFamily GaugeFamily(const std::string& name, const std::string& help,
                                     double value) {
  prometheus::MetricFamily family{name, help, prometheus::MetricType::Gauge, {}};
  family.metric.emplace_back().gauge.value = value;
  return family;
}

}  // namespace

std::vector<prometheus::MetricFamily> ProcessFamilies() {
  std::vector<prometheus::MetricFamily> families;
  prometheus::MetricFamily cpu{"process_cpu_seconds_total",
                               "User and system processor time.",
                               prometheus::MetricType::Counter,
                               {}};
  cpu.metric.emplace_back().counter.value = CpuSeconds();
  families.push_back(std::move(cpu));

  // In pages: total, resident.
  std::ifstream memory("/proc/self/statm");
  double all = 0, resident = 0;
  if (memory >> all >> resident) {
    const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
    families.push_back(GaugeFamily("process_virtual_memory_bytes", "Virtual memory.", all * page));
    families.push_back(
        GaugeFamily("process_resident_memory_bytes", "Resident memory.", resident * page));
  }
  std::error_code error;
  const std::filesystem::directory_iterator open("/proc/self/fd", error),
      threads("/proc/self/task", error);
  if (!error) {
    // One of them is the listing itself.
    families.push_back(GaugeFamily("process_open_fds", "Open file descriptors.",
                                   static_cast<double>(std::distance(begin(open), end(open)) - 1)));
    families.push_back(
        GaugeFamily("process_threads", "Threads.",
                    static_cast<double>(std::distance(begin(threads), end(threads)))));
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    families.push_back(GaugeFamily("process_max_fds", "File descriptors that may be open.",
                                   static_cast<double>(limit.rlim_cur)));
  }
  return families;
}

}  // namespace partiemc::server
