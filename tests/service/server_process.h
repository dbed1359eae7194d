// Runs partiemc-server as a process and reads its figures from the system.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "support/temporary_folder.h"

namespace partiemc::server {

std::string FileText(const std::string& path);

/// Path of the server built with the tests.
std::string ServerProgram();

/// Environment of a server process.
struct Surroundings {
  std::vector<std::string> environment = {};  ///< NAME=VALUE, added to this process's environment.
  int standard_error = -1;                    ///< A file descriptor; -1: captured in Output().
  std::string program = {};                   ///< Empty: the one built with the tests.
};

/// partiemc-server with these arguments, with its output in a file. Both end with this object.
class ServerProcess {
 public:
  explicit ServerProcess(std::vector<std::string> arguments, const Surroundings& surroundings = {});
  ~ServerProcess();
  ServerProcess(ServerProcess&& other) noexcept;
  ServerProcess& operator=(ServerProcess&&) = delete;

  void Signal(int signal);
  /// The exit code, or -1 if a signal ended it.
  int Wait();
  /// Same as Wait; empty if it still runs after `time`.
  std::optional<int> WaitFor(std::chrono::milliseconds time);

  std::string Output() const { return FileText(folder_->Path("output")); }
  pid_t process() const { return process_; }

  // Requires that it runs:
  double ResidentMib() const;
  std::size_t ThreadCount() const;
  /// The kernel truncates names to 15 characters.
  std::vector<std::string> ThreadNames() const;
  std::size_t OpenFileCount() const;

 private:
  std::optional<int> Reap(int options);
  double StatusNumber(const std::string& field) const;

  std::unique_ptr<const support::TemporaryFolder> folder_;
  pid_t process_ = 0;
};

/// Runs the server with these arguments; returns the exit code.
int RunServer(const std::vector<std::string>& arguments, std::string* output = nullptr);

/// A server on a loopback port of its choice.
class ServingProcess {
 public:
  explicit ServingProcess(std::vector<std::string> arguments = {},
                          const Surroundings& surroundings = {});
  const std::string& address() const { return address_; }
  ServerProcess& process() { return process_; }
  const ServerProcess& process() const { return process_; }

 private:
  support::TemporaryFolder folder_;
  ServerProcess process_;
  std::string address_;
};

}  // namespace partiemc::server
