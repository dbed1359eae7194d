#include "service/process_clocks.h"

#include <time.h>

#include <filesystem>
#include <fstream>

namespace partiemc::server {

double ProcessCpuMs(pid_t process) {
  clockid_t clock{};
  timespec time{};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &time) != 0) return -1;
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

double ThreadsCpuMs(pid_t process, const std::string& name) {
  double ms = 0;
  std::error_code gone;
  const std::string tasks = "/proc/" + std::to_string(process) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks, gone)) {
    std::string thread_name;
    std::getline(std::ifstream(task.path() / "comm") >> std::ws, thread_name);
    double nanoseconds = 0;
    if (thread_name == name && std::ifstream(task.path() / "schedstat") >> nanoseconds) {
      ms += nanoseconds * 1e-6;
    }
  }
  return ms;
}

}  // namespace partiemc::server
