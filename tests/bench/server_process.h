// A partiemc-server of our own, as a process.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace partiemc::bench {

enum class Transport { kTcp, kUnix };

class ServerProcess {
 public:
  /// Starts one on a free port of loopback or on a socket in a new temporary folder, and waits
  /// until it serves. Ends the program where it does not. The system kills it when the thread that
  /// starts it ends, however it ends.
  explicit ServerProcess(Transport transport, const std::vector<std::string>& flags = {});
  /// Asks it to leave, and waits until it has.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  const std::string& address() const { return address_; }
  pid_t process() const { return process_; }
  double CpuMs() const;
  double ResidentMb() const { return StatusMb("VmRSS:"); }
  double PeakMb() const { return StatusMb("VmHWM:"); }

 private:
  double StatusMb(const std::string& field) const;

  support::TemporaryFolder folder_;
  std::string address_;
  pid_t process_ = 0;
};

}  // namespace partiemc::bench
