#include <signal.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "absl/synchronization/mutex.h"
#include "server/health_check.h"
#include "server/heap.h"
#include "server/logging.h"
#include "server/options.h"
#include "server/server.h"

namespace partiemc::server {
namespace {

constexpr std::chrono::seconds kHealthCheckTimeout{3};

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "partiemc-server: %s\n", std::string(status.message()).c_str());
  return 1;
}

// Under a temporary name first: who waits for the file must not read half of it.
absl::Status WritePortFile(const std::string& path, const Address& address) {
  const std::string temporary = path + ".part";
  std::ofstream file(temporary);
  file << address.ToString() << '\n';
  file.close();
  std::error_code error;
  if (file.good()) std::filesystem::rename(temporary, path, error);
  if (!file.good() || error) {
    return absl::UnavailableError("cannot write --port-file " + path +
                                  ": is its folder there, and may this user write to it?");
  }
  return absl::OkStatus();
}

int Serve(const CommandLine& line) {
  KeepFreedMemory();
  // Distributions build abseil with its search for deadlocks, which every lock of gRPC pays for.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  // Before gRPC starts threads, so that these signals wait for sigwait and interrupt nobody.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);

  SetUpLogging(line.log_level, line.log_format);
  auto server = Server::Start(line.server);
  if (!server.ok()) return Fail(server.status());
  if (line.port_file) {
    if (auto status = WritePortFile(*line.port_file, (*server)->address()); !status.ok()) {
      return Fail(status);
    }
  }
  const auto metrics = (*server)->metrics_address();
  LogEvent(spdlog::level::info, "listening on " + (*server)->address().ToString(),
           {{"version", PARTIEMC_VERSION},
            {"threads", std::uint64_t{line.server.threads}},
            {"max_streams", std::uint64_t{line.server.limits.max_streams}},
            {"memory_budget", line.server.limits.memory_budget},
            {"tls", line.server.tls ? "on" : "off"},
            {"tokens", line.server.token_file ? "on" : "off"},
            {"metrics", metrics ? metrics->ToString() : "off"}});
  int signal = 0;
  sigwait(&signals, &signal);
  spdlog::info("draining after {}", strsignal(signal));
  (*server)->Drain(line.grace);
  spdlog::info("stopped");
  return 0;
}

}  // namespace
}  // namespace partiemc::server

int main(int argc, char** argv) {
  using namespace partiemc::server;
  const auto parsed = ParseCommandLine(argc, argv);
  if (const auto* leave = std::get_if<Leave>(&parsed)) {
    std::fputs(leave->text.c_str(), leave->code == 0 ? stdout : stderr);
    return leave->code;
  }
  const auto& line = std::get<CommandLine>(parsed);
  if (!line.health_check) return Serve(line);
  SetUpLogging("off", LogFormat::kText);  // gRPC would tell standard error of every attempt.
  const auto status =
      CheckHealth(*line.health_check, kHealthCheckTimeout, line.health_check_security);
  return status.ok() ? 0 : Fail(status);
}
