// Debian's nats-server on a fixed loopback port.
#pragma once

#include <sys/types.h>

#include <string>

namespace partiemc::server {

class NatsProcess {
 public:
  /// Serves when it returns. Fails the test if the program is missing.
  NatsProcess();
  ~NatsProcess() { Stop(); }
  NatsProcess(const NatsProcess&) = delete;
  NatsProcess& operator=(const NatsProcess&) = delete;

  std::string url() const { return "nats://127.0.0.1:" + std::to_string(port_); }

  /// kill -9.
  void Stop();
  /// Starts it again at the same port.
  void Start();
  /// Keeps its connections and says nothing until Continue.
  void Freeze();
  void Continue();

 private:
  int port_ = 0;
  pid_t process_ = 0;
};

}  // namespace partiemc::server
