// partiemc-server as a process, and what the system tells about it.
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

/// The path of the server that was built with the tests.
std::string ServerProgram();

/// What a server is started with beside its arguments.
struct Surroundings {
  std::vector<std::string> environment = {};  ///< NAME=VALUE, beside this process's own.
  int standard_error = -1;                    ///< A file descriptor; -1: in Output().
  std::string program = {};                   ///< Empty: the one that was built with the tests.
};

/// partiemc-server with these arguments, its output in a file. Both are gone when this
/// goes out of scope.
class ServerProcess {
 public:
  explicit ServerProcess(std::vector<std::string> arguments, const Surroundings& surroundings = {});
  ~ServerProcess();
  ServerProcess(ServerProcess&& other) noexcept;
  ServerProcess& operator=(ServerProcess&&) = delete;

  void Signal(int signal);
  /// The exit code, or -1 for a death by signal.
  int Wait();
  /// As Wait; nothing if it is still there after `time`.
  std::optional<int> WaitFor(std::chrono::milliseconds time);

  std::string Output() const { return FileText(folder_->Path("output")); }
  pid_t process() const { return process_; }

  // While it runs:
  double ResidentMib() const;
  std::size_t ThreadCount() const;
  std::size_t ThreadCount(std::string_view name) const;  // As the kernel cuts it: 15 characters.
  std::size_t OpenFileCount() const;

 private:
  std::optional<int> Reap(int options);
  double StatusNumber(const std::string& field) const;

  std::unique_ptr<const support::TemporaryFolder> folder_;
  pid_t process_ = 0;
};

/// The exit code of a run with these arguments.
int RunServer(const std::vector<std::string>& arguments, std::string* output = nullptr);

/// One that serves on a port of loopback that it chose itself.
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
