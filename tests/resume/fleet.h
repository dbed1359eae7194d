// Several servers as processes that come back where they were, and a proxy in front of them.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "service/server_process.h"
#include "support/temporary_folder.h"

namespace partiemc::resume {

class Fleet {
 public:
  /// Each with these arguments beside its address. Every other start is one of the other program
  /// that the options name.
  explicit Fleet(std::size_t count, std::vector<std::string> arguments = {});

  std::size_t size() const { return servers_.size(); }
  /// Stay the same.
  const std::vector<std::string>& addresses() const { return addresses_; }
  /// What a server has logged since it was started last.
  std::string Output(std::size_t server) const { return servers_[server]->Output(); }

  /// kill -9, and once it has gone the same again at the same address.
  void KillAndRestart(std::size_t server);
  /// SIGTERM likewise; gives the exit code, nothing where it did not go within `grace`.
  std::optional<int> TerminateAndRestart(std::size_t server, std::chrono::seconds grace);

 private:
  void Start(std::size_t server, const std::string& address);

  const std::vector<std::string> arguments_;
  std::vector<std::unique_ptr<server::ServerProcess>> servers_;
  std::vector<std::string> addresses_;
  std::size_t starts_ = 0;
};

/// What stands between clients and servers.
enum class Route { kList, kHaproxy, kNginx };

/// "List", "Haproxy" or "Nginx".
std::string RouteName(Route route);

/// A proxy as Debian has it, on a Unix socket. Ended when it goes out of scope.
class ProxyProcess {
 public:
  /// Serves when it returns. A missing program fails the test.
  ProxyProcess(Route route, const std::vector<std::string>& servers);
  ~ProxyProcess();
  ProxyProcess(const ProxyProcess&) = delete;
  ProxyProcess& operator=(const ProxyProcess&) = delete;

  std::string address() const { return "unix:" + socket_; }

 private:
  support::TemporaryFolder folder_;
  std::string socket_;
  pid_t process_ = 0;
};

}  // namespace partiemc::resume
