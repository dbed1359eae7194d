// partiemc-server as a process that is attacked, and what tells whether it bears it.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "service/server_process.h"

namespace partiemc::attack {

class AttackedServer {
 public:
  /// With metrics; unless `arguments` say otherwise, its log off, two threads, 20 s to drain.
  explicit AttackedServer(std::vector<std::string> arguments = {},
                          const server::Surroundings& surroundings = {});

  const std::string& address() const { return serving_->address(); }
  server::ServerProcess& process() { return serving_->process(); }

  /// Whether the process is there.
  bool Lives();
  /// Of a process that is there.
  double ResidentMib() const { return serving_->process().ResidentMib(); }
  /// The most that it ever was.
  double PeakMib() const;
  /// Processor time of all of its threads.
  double ProcessorSeconds() const;

  /// A metric without labels; -1 where the server gives none.
  double Gauge(const std::string& name) const;
  /// Waits until nothing is open, nothing waits and nothing is held. Tells what is not at zero.
  std::string GaugesNotAtZero(std::chrono::milliseconds time) const;

  /// SIGTERM; the exit code, -1 for a death by signal, -2 where it has not left in `time`.
  int Terminate(std::chrono::milliseconds time = std::chrono::seconds(30));
  std::string Output() { return process().Output(); }

 private:
  std::string metrics_address_;
  std::unique_ptr<server::ServingProcess> serving_;
  bool gone_ = false;
  int code_ = 0;
};

/// haproxy with docker/haproxy.cfg, as it is said there, in front of a server. Ended when it goes
/// out of scope.
class Proxy {
 public:
  /// Serves when it returns. A missing program fails the test. `certificate`: the file NAME.crt,
  /// beside NAME.key, of a proxy with TLS.
  explicit Proxy(const std::string& server, const std::string& certificate = "");
  ~Proxy();
  Proxy(const Proxy&) = delete;
  Proxy& operator=(const Proxy&) = delete;

  const std::string& address() const { return address_; }
  pid_t process() const { return process_; }

 private:
  std::string address_;
  pid_t process_ = 0;
};

/// The resident memory of a process, looked at every 20 ms in a thread.
class MemoryWatch {
 public:
  explicit MemoryWatch(pid_t process);
  ~MemoryWatch();
  /// The most since the beginning.
  double PeakMib() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace partiemc::attack
