#include "attack/attacked_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "attack/http2_client.h"
#include "attack/options.h"

namespace partiemc::attack {
namespace {

double StatusMib(pid_t process, const std::string& field) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  double kib = 0;
  for (std::string word; status >> word;) {
    if (word == field && status >> kib) break;
  }
  return kib / 1024;
}

std::string HttpGet(const std::string& address, const std::string& path) {
  const auto colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int file = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const timeval patience{10, 0};
  setsockopt(file, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string text;
  const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
  if (::connect(file, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0 &&
      ::send(file, request.data(), request.size(), MSG_NOSIGNAL) > 0) {
    char buffer[4096];
    for (ssize_t got; (got = ::recv(file, buffer, sizeof buffer, 0)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(got));
    }
  }
  ::close(file);
  return text;
}

}  // namespace

std::string FreeAddress() {
  const int file = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(file, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    throw std::runtime_error("no free port on loopback");
  }
  ::close(file);
  return "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

double PlannedMib(std::vector<std::string> arguments) {
  arguments.push_back("--print-memory-plan");
  std::string plan;
  EXPECT_EQ(server::RunServer(arguments, &plan), 0) << plan;
  const auto line = plan.rfind('\n', plan.size() - 2) + 1;
  return std::stod(plan.substr(line));
}

AttackedServer::AttackedServer(std::vector<std::string> arguments,
                               const server::Surroundings& surroundings) {
  if (std::find(arguments.begin(), arguments.end(), "--threads") == arguments.end()) {
    arguments.insert(arguments.end(), {"--threads", "2"});
  }
  if (std::find(arguments.begin(), arguments.end(), "--log-level") == arguments.end()) {
    arguments.insert(arguments.end(), {"--log-level", "off"});
  }
  // Histories of honest streams would hide the attackers' memory.
  if (std::find(arguments.begin(), arguments.end(), "--history-bytes") == arguments.end()) {
    arguments.insert(arguments.end(), {"--history-bytes", "1MB"});
  }
  // On a busy machine, releasing an attack's resources may take more than four seconds.
  if (std::find(arguments.begin(), arguments.end(), "--grace-seconds") == arguments.end()) {
    arguments.insert(arguments.end(), {"--grace-seconds", "20"});
  }
  // Another process may take the port before the server does.
  for (int attempt = 0; serving_ == nullptr; ++attempt) {
    metrics_address_ = FreeAddress();
    auto all = arguments;
    all.insert(all.end(), {"--metrics", metrics_address_});
    try {
      server::Surroundings around = surroundings;
      if (!GetOptions().server.empty()) around.program = GetOptions().server;
      serving_ = std::make_unique<server::ServingProcess>(all, around);
    } catch (const std::runtime_error&) {
      if (attempt == 2) throw;
    }
  }
}

bool AttackedServer::Lives() {
  if (gone_) return false;
  if (const auto code = process().WaitFor(std::chrono::milliseconds(0))) {
    gone_ = true;
    code_ = *code;
  }
  return !gone_;
}

double AttackedServer::PeakMib() const {
  return StatusMib(serving_->process().process(), "VmHWM:");
}

double AttackedServer::ProcessorSeconds() const {
  std::ifstream file("/proc/" + std::to_string(serving_->process().process()) + "/stat");
  std::string line;
  std::getline(file, line);
  std::istringstream fields(line.substr(std::min(line.size(), line.rfind(')') + 2)));
  std::string skipped;
  for (int k = 0; k < 11; ++k) fields >> skipped;
  double user = 0, kernel = 0;
  fields >> user >> kernel;
  return (user + kernel) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double AttackedServer::Gauge(const std::string& name) const {
  std::istringstream lines(HttpGet(metrics_address_, "/metrics"));
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(name + " ", 0) == 0) return std::stod(line.substr(name.size() + 1));
  }
  return -1;
}

std::string AttackedServer::GaugesNotAtZero(std::chrono::milliseconds time) const {
  const auto give_up = std::chrono::steady_clock::now() + time;
  while (true) {
    std::string wrong;
    for (const char* name :
         {"partiemc_streams", "partiemc_watchers", "partiemc_compute_queue_length",
          "partiemc_memory_held_bytes", "partiemc_watched_bytes"}) {
      const double value = Gauge(name);
      if (value != 0) wrong += std::string(name) + " " + std::to_string(value) + "; ";
    }
    if (wrong.empty() || std::chrono::steady_clock::now() > give_up) return wrong;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

int AttackedServer::Terminate(std::chrono::milliseconds time) {
  if (!Lives()) return code_;
  process().Signal(SIGTERM);
  const auto code = process().WaitFor(time);
  if (!code) return -2;
  gone_ = true;
  return code_ = *code;
}

Proxy::Proxy(const std::string& server, const std::string& certificate) {
  address_ = FreeAddress();
  std::vector<std::string> arguments = {"/usr/sbin/haproxy", "-db", "-q", "-f",
                                        PARTIEMC_SOURCE_DIR "/docker/haproxy.cfg"};
  std::vector<std::string> environment = {"PARTIEMC_PROXY=" + address_,
                                          "PARTIEMC_SERVER=" + server};
  if (!certificate.empty()) environment.push_back("PARTIEMC_PROXY_CERT=" + certificate);
  std::vector<char*> argv, envp;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  for (std::string& variable : environment) envp.push_back(variable.data());
  argv.push_back(nullptr);
  envp.push_back(nullptr);
  if (posix_spawn(&process_, argv[0], nullptr, nullptr, argv.data(), envp.data()) != 0) {
    process_ = 0;
    throw std::runtime_error("haproxy cannot be started: docker/install.sh tests");
  }
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (true) {
    try {
      Http2Client(address_, {.greet = false});
      return;
    } catch (const std::runtime_error&) {
      if (std::chrono::steady_clock::now() > give_up) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
}

Proxy::~Proxy() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

struct MemoryWatch::State {
  std::atomic<double> peak = 0;
  std::atomic<bool> stop = false;
  std::thread thread;
};

MemoryWatch::MemoryWatch(pid_t process) : state_(std::make_unique<State>()) {
  state_->thread = std::thread([state = state_.get(), process] {
    while (!state->stop) {
      const double now = StatusMib(process, "VmRSS:");
      if (now > state->peak) state->peak = now;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
}

MemoryWatch::~MemoryWatch() {
  state_->stop = true;
  state_->thread.join();
}

double MemoryWatch::PeakMib() const { return state_->peak; }

}  // namespace partiemc::attack
