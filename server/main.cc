#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <tuple>

#include "absl/synchronization/mutex.h"
#include "server/options.h"
#include "server/rpc/health_check.h"
#include "server/server.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

constexpr std::chrono::seconds kHealthCheckTimeout{3};

// Time that cancelled work gets to end, after the grace time has passed.
constexpr std::chrono::milliseconds kTimeToEnd{500};
// Signals that follow the first one within this time count as the same: `timeout` and terminals may
// send a signal twice, to the process and to its group.
constexpr std::chrono::milliseconds kSameSignal{300};
constexpr int kCutOff = 1;  // Exit code if the work has not ended by then.

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "partiemc-server: %s\n", std::string(status.message()).c_str());
  return 1;
}

// Raises the process's limit of descriptors to the maximum, because each connection uses two.
void TakeAllDescriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// Writes the address to a temporary file and renames it, so that no reader sees half of the file.
absl::Status WritePortFile(const std::string& flag, const std::string& path,
                           const Address& address) {
  const std::string temporary = path + ".part";
  std::ofstream file(temporary);
  file << address.ToString() << '\n';
  file.close();
  std::error_code error;
  if (file.good()) std::filesystem::rename(temporary, path, error);
  if (!file.good() || error) {
    return absl::UnavailableError("cannot write " + flag + " " + path +
                                  ": check that its folder exists and is writable");
  }
  return absl::OkStatus();
}

// Waits for a signal. Returns the received signal, or 0 after `time`.
int WaitForSignal(const sigset_t& signals, std::chrono::milliseconds time) {
  const auto until = std::chrono::steady_clock::now() + time;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(
        until - std::chrono::steady_clock::now());
    if (left.count() <= 0) return 0;
    const timespec timeout{.tv_sec = static_cast<time_t>(left.count() / 1'000'000'000),
                           .tv_nsec = static_cast<long>(left.count() % 1'000'000'000)};
    const int signal = sigtimedwait(&signals, nullptr, &timeout);
    if (signal > 0) return signal;
  }
}

// The first thread that sets this flag ends the process: the main thread after the drain, or the
// thread of CutDrainShort.
std::atomic<bool> leaving = false;

// After a second signal, or after `grace` and kTimeToEnd, ends the process unless it has drained.
void CutDrainShort(const sigset_t& signals, std::chrono::milliseconds grace) {
  const auto until = std::chrono::steady_clock::now() + grace + kTimeToEnd;
  const auto same_until = std::chrono::steady_clock::now() + kSameSignal;
  while (WaitForSignal(signals, std::chrono::ceil<std::chrono::milliseconds>(
                                    same_until - std::chrono::steady_clock::now())) != 0) {
  }
  const int signal = WaitForSignal(signals, std::chrono::ceil<std::chrono::milliseconds>(
                                                until - std::chrono::steady_clock::now()));
  if (leaving.exchange(true)) return;
  LogEvent(spdlog::level::warn, "cut off",
           {{"at", signal != 0 ? strsignal(signal) : "the end of the grace time"}});
  FlushLog();
  _exit(signal != 0 ? 128 + signal : kCutOff);
}

int Serve(const CommandLine& line) {
  TakeAllDescriptors();
  // Disables abseil's deadlock detection. Linux distributions build abseil with it, and it slows
  // down every lock of gRPC.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  // Blocks these signals before gRPC starts threads, which inherit the mask. So only sigwait and
  // sigtimedwait receive the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigset_t all_signals = signals;
  sigaddset(&all_signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &all_signals, nullptr);

  signal(SIGPIPE, SIG_IGN);  // The reader of the log may exit.

  SetUpLogging(line.log_level, line.log_format);
  FlushLogOnAbort();
  RefuseTraces();
  for (const std::string& name : line.ignored_variables) {
    LogEvent(spdlog::level::warn, "variable ignored",
             {{"name", name}, {"error", "the server has no option of this name"}});
  }
  LimitReadsOfGrpc();
  auto server = Server::Start(line.server);
  if (!server.ok()) return Fail(server.status());
  const auto web = (*server)->web_address();
  for (const auto& [flag, path, address] :
       {std::tuple("--port-file", line.port_file, std::optional((*server)->address())),
        std::tuple("--web-port-file", line.web_port_file, web)}) {
    if (!path || !address) continue;
    if (auto status = WritePortFile(flag, *path, *address); !status.ok()) return Fail(status);
  }
  const auto metrics = (*server)->metrics_address();
  LogEvent(spdlog::level::info, "listening on " + (*server)->address().ToString(),
           {{"version", PARTIEMC_VERSION},
            {"threads", std::uint64_t{line.server.threads}},
            {"max_streams", std::uint64_t{line.server.limits.max_streams}},
            {"memory_budget", line.server.limits.memory_budget},
            {"tls", line.server.tls ? "on" : "off"},
            {"tokens", line.server.token_file ? "on" : "off"},
            {"web", web ? web->ToString() : "off"},
            {"nats", line.server.nats ? "on" : "off"},
            {"metrics", metrics ? metrics->ToString() : "off"}});
  int signal = 0;
  while (sigwait(&all_signals, &signal) == 0 && signal == SIGHUP) {
    LogEvent(spdlog::level::info, "nothing to do after Hangup: changed files are reloaded anyway",
             {});
  }
  LogEvent(spdlog::level::info, std::string("draining after ") + strsignal(signal), {});
  std::thread(CutDrainShort, signals, line.drain_delay + line.grace).detach();
  if (line.drain_delay.count() > 0) (*server)->SendAway(line.drain_delay);
  (*server)->Drain(line.grace);
  server->reset();
  // If CutDrainShort has set the flag first, it ends the process; this thread waits for that.
  while (leaving.exchange(true)) std::this_thread::sleep_for(kTimeToEnd);
  LogEvent(spdlog::level::info, "stopped", {});
  FlushLog();
  return 0;
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using namespace partiemc::server;
  const auto parsed = ParseCommandLine(argc, argv);
  if (const auto* early = std::get_if<EarlyExit>(&parsed)) {
    std::fputs(early->text.c_str(), early->code == 0 ? stdout : stderr);
    return early->code;
  }
  const auto& line = std::get<CommandLine>(parsed);
  if (!line.health_check) return Serve(line);
  SetUpLogging("off", LogFormat::kText);  // gRPC would print every attempt to standard error.
  RefuseTraces();
  for (const std::string& name : line.ignored_variables) {
    LogEvent(spdlog::level::warn, "variable ignored",
             {{"name", name}, {"error", "the server has no option of this name"}});
  }
  const auto status =
      CheckHealth(*line.health_check, kHealthCheckTimeout, line.health_check_security);
  return status.ok() ? 0 : Fail(status);
}
