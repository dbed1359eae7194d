#include "bench/server_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench/clocks.h"
#include "bench/progress.h"

namespace partiemc::bench {
namespace {

constexpr double kStartDeadlineMs = 20'000;

// Starts a process that ends with this one, however that ends.
pid_t Spawn(std::vector<std::string> arguments, const std::filesystem::path& log) {
  constexpr int kCannotStart = 127;
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const pid_t bench = getpid();
  const pid_t process = fork();
  if (process < 0) Fail("cannot start " + arguments[0]);
  if (process > 0) return process;
  // The new process: nothing but calls that are safe after a fork beside other threads.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != bench) _exit(kCannotStart);  // It ended before it could be watched.
  const int file = open(log.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  if (file < 0 || dup2(file, STDERR_FILENO) < 0) _exit(kCannotStart);
  execv(argv[0], argv.data());
  _exit(kCannotStart);
}

}  // namespace

ServerProcess::ServerProcess(Transport transport, const std::vector<std::string>& flags) {
  const std::filesystem::path port_file = folder_ / "address", log = folder_ / "log";
  const std::string listen = transport == Transport::kTcp ? std::string("127.0.0.1:0")
                                                          : "unix:" + (folder_ / "socket").string();
  std::vector<std::string> command = {PARTIEMC_SERVER, "--address", listen, "--port-file",
                                      port_file.string()};
  command.insert(command.end(), flags.begin(), flags.end());
  process_ = Spawn(command, log);
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
