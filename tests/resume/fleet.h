// Several server processes that restart at the same address, and a proxy in front of them.
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

/// Limit of a connection, and of a server that terminates.
inline constexpr std::chrono::seconds kGrace(20);

class Fleet {
 public:
  /// Starts each server with these arguments and its address. With --other-server every second
  /// start uses that program.
  explicit Fleet(std::size_t count, std::vector<std::string> arguments = {});

  std::size_t size() const { return servers_.size(); }
  /// Constant.
  const std::vector<std::string>& addresses() const { return addresses_; }
  /// The server's log since its last start.
  std::string Output(std::size_t server) const { return servers_[server]->Output(); }

  /// kill -9, then starts it again at the same address.
  void KillAndRestart(std::size_t server);
  /// SIGTERM, then a new start; returns the exit code, or nothing if it did not exit within
  /// `grace`.
  std::optional<int> TerminateAndRestart(std::size_t server, std::chrono::seconds grace);

 private:
  void Start(std::size_t server, const std::string& address);

  const std::vector<std::string> arguments_;
  std::vector<std::unique_ptr<server::ServerProcess>> servers_;
  std::vector<std::string> addresses_;
  std::size_t starts_ = 0;
};

/// Connection between clients and servers.
enum class Route { kList, kHaproxy, kNginx };

/// "List", "Haproxy" or "Nginx".
std::string RouteName(Route route);

/// A proxy of Debian on a Unix socket, during the lifetime of this object.
class ProxyProcess {
 public:
  /// Serves when it returns. Fails the test if the program is missing.
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
