// The running server: gRPC's server with the service, health and reflection, and its drain.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/address.h"
#include "server/compute_pool.h"
#include "server/idle_timer.h"
#include "server/limits.h"
#include "server/memory_budget.h"
#include "server/stream_registry.h"

namespace grpc {
class Channel;
class Server;
}  // namespace grpc

namespace partiemc::server {

class Service;

struct ServerOptions {
  Address address{.host = "127.0.0.1", .port = 50051, .unix_path = {}};
  /// Allows an address beyond this machine, although everything travels in the clear.
  bool insecure = false;
  /// Threads that compute, all streams together, at least 1.
  unsigned threads = 1;
  ServerLimits limits;
};

class Server {
 public:
  /// Listens and serves when it returns.
  /// Errors: INVALID_ARGUMENT for an address beyond this machine without `insecure`, UNAVAILABLE
  /// where it cannot listen; a line that says what, where and what to do.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options);

  /// Stops at once if it was not drained.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the port that it got.
  const Address& address() const { return address_; }

  /// To this server without a socket, for tests and embedding.
  std::shared_ptr<grpc::Channel> InProcessChannel();

  /// Takes no new call, tells the streams, answers what they have sent, and stops. What is not done
  /// shortly before the end of `grace` is cancelled. Returns when nothing goes on any more.
  void Drain(std::chrono::milliseconds grace);

 private:
  explicit Server(const ServerOptions& options);

  absl::Status Listen();
  void WaitUntilNobodyComes(std::chrono::steady_clock::time_point deadline) const;

  const ServerOptions options_;
  Address address_;
  StreamRegistry registry_;
  MemoryBudget budget_;
  ComputePool pool_;
  IdleTimer idle_timer_;
  std::unique_ptr<Service> service_;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace partiemc::server
