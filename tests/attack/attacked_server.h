// A partiemc-server process to attack, and its figures.
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
  /// Enables metrics. Unless `arguments` set them: log off, two threads, 20 s to drain.
  explicit AttackedServer(std::vector<std::string> arguments = {},
                          const server::Surroundings& surroundings = {});

  const std::string& address() const { return serving_->address(); }
  server::ServerProcess& process() { return serving_->process(); }

  /// True if the process runs.
  bool Lives();
  /// Requires that the process runs.
  double ResidentMib() const { return serving_->process().ResidentMib(); }
  /// Maximum resident memory.
  double PeakMib() const;
  /// Processor time of all of its threads.
  double ProcessorSeconds() const;

  /// A metric without labels; -1 if it does not exist.
  double Gauge(const std::string& name) const;
  /// Waits until nothing is open, waiting or held. Returns the gauges that are not zero.
  std::string GaugesNotAtZero(std::chrono::milliseconds time) const;

  /// SIGTERM. Returns the exit code, -1 after a signal, -2 if it has not exited within `time`.
  int Terminate(std::chrono::milliseconds time = std::chrono::seconds(30));
  std::string Output() { return process().Output(); }

 private:
  std::string metrics_address_;
  std::unique_ptr<server::ServingProcess> serving_;
  bool gone_ = false;
  int code_ = 0;
};

/// A free address of loopback.
std::string FreeAddress();

/// The sum of --print-memory-plan of a server with these arguments, in MiB.
double PlannedMib(std::vector<std::string> arguments);

/// haproxy with docker/haproxy.cfg in front of a server, during the lifetime of this object.
class Proxy {
 public:
  /// Serves when it returns. Fails the test if the program is missing. `certificate`: for TLS, the
  /// file NAME.crt beside NAME.key.
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

/// Samples the resident memory of a process every 20 ms in a thread.
class MemoryWatch {
 public:
  explicit MemoryWatch(pid_t process);
  ~MemoryWatch();
  /// Maximum since the start.
  double PeakMib() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace partiemc::attack
