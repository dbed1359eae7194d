#include "relay/nats_process.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <vector>

extern char** environ;

namespace partiemc::server {
namespace {

constexpr std::chrono::seconds kStartTime(30);

sockaddr_in Loopback(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

int FreePort() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = Loopback(0);
  socklen_t size = sizeof(address);
  bind(fd, reinterpret_cast<sockaddr*>(&address), size);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  close(fd);
  return ntohs(address.sin_port);
}

bool Listens(int port) {
  const sockaddr_in address = Loopback(port);
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  const int result = connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  close(fd);
  return result == 0;
}

}  // namespace

NatsProcess::NatsProcess() : port_(FreePort()) { Start(); }

void NatsProcess::Stop() {
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
  process_ = 0;
}

void NatsProcess::Freeze() { kill(process_, SIGSTOP); }
void NatsProcess::Continue() { kill(process_, SIGCONT); }

void NatsProcess::Start() {
  std::vector<std::string> arguments = {"/usr/sbin/nats-server", "-a", "127.0.0.1", "-p",
                                        std::to_string(port_),   "-l", "/dev/null"};
  if (access(arguments.front().c_str(), X_OK) != 0) arguments.front() = "/usr/bin/nats-server";
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int failed = posix_spawn(&process_, argv[0], nullptr, nullptr, argv.data(), environ);
  ASSERT_EQ(failed, 0) << "nats-server cannot be started: docker/install.sh tests";
  const auto give_up = std::chrono::steady_clock::now() + kStartTime;
  while (!Listens(port_)) {
    ASSERT_LT(std::chrono::steady_clock::now(), give_up) << "nats-server does not come up";
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace partiemc::server
