#include "bench/server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include "bench/clocks.h"
#include "bench/progress.h"

extern char** environ;

namespace partiemc::bench {
namespace {

constexpr double kStartDeadlineMs = 20'000;

std::filesystem::path NewFolder() {
  std::string folder = (std::filesystem::temp_directory_path() / "partiemc_bench_XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) Fail("cannot create a temporary folder " + folder);
  return folder;
}

pid_t Spawn(std::vector<std::string> arguments, const std::filesystem::path& log) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(),
                                   O_CREAT | O_TRUNC | O_WRONLY, 0600);
  pid_t process = 0;
  const int error = posix_spawn(&process, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) Fail("cannot start " + arguments[0]);
  return process;
}

}  // namespace

ServerProcess::ServerProcess(Transport transport) : folder_(NewFolder()) {
  const std::filesystem::path port_file = folder_ / "address", log = folder_ / "log";
  const std::string listen = transport == Transport::kTcp ? std::string("127.0.0.1:0")
                                                          : "unix:" + (folder_ / "socket").string();
  process_ = Spawn({PARTIEMC_SERVER, "--address", listen, "--port-file", port_file.string()}, log);
  const double begin = WallMs();
  while (!std::filesystem::exists(port_file)) {
    int status = 0;
    if (waitpid(process_, &status, WNOHANG) != 0) {
      std::string why;
      std::ifstream log_file(log);
      for (std::string line; std::getline(log_file, line);) why += "\n  " + line;
      Fail("partiemc-server ended before it served:" + why);
    }
    if (WallMs() - begin > kStartDeadlineMs) Fail("partiemc-server does not serve");
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::ifstream file(port_file);
  std::getline(file, address_);
}

ServerProcess::~ServerProcess() {
  kill(process_, SIGTERM);
  int status = 0;
  waitpid(process_, &status, 0);
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

double ServerProcess::CpuMs() const {
  clockid_t clock{};
  if (clock_getcpuclockid(process_, &clock) != 0) Fail("partiemc-server is gone");
  return Milliseconds(clock);
}

double ServerProcess::StatusMb(const std::string& field) const {
  std::ifstream status("/proc/" + std::to_string(process_) + "/status");
  for (std::string word; status >> word;) {
    double kibibytes = 0;
    if (word == field && status >> kibibytes) return kibibytes * 1024 / 1e6;
  }
  Fail("partiemc-server is gone");
}

}  // namespace partiemc::bench
