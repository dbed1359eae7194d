// Accepts connections for gRPC.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "absl/status/statusor.h"
#include "common/address.h"
#include "server/connections/connection_watch.h"
#include "server/connections/hand_over.h"
#include "server/connections/sockets.h"

namespace partiemc::server {

/// Owns the sockets that listen, and gives each connection to a ConnectionWatch and to gRPC.
class Acceptor {
 public:
  /// Takes the descriptor of a connection.
  using HandOver = std::function<void(int descriptor)>;

  /// Listens when it returns, and accepts nothing before Start. `watch` lives longer. A connection
  /// ends whose peer does not acknowledge for `dead_after`.
  /// Errors: UNAVAILABLE where it cannot listen.
  static absl::StatusOr<std::unique_ptr<Acceptor>> Listen(const Address& address,
                                                          std::chrono::milliseconds dead_after,
                                                          ConnectionWatch& watch);
  /// Waits until every hand-over has returned.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  std::uint16_t port() const { return port_; }

  void Start(HandOver hand_over);

  /// Refuses connections from now on.
  void StopListening();

 private:
  Acceptor(Address address, Listeners listeners, ConnectionWatch& watch);
  void Run();
  bool AcceptAll(int listener);

  const Address address_;
  const std::uint16_t port_;
  ConnectionWatch& watch_;
  std::vector<Descriptor> sockets_;  // Of the thread, once it runs.
  const Descriptor wake_;
  std::unique_ptr<HandOverThreads> hand_over_;
  std::thread thread_;
};

}  // namespace partiemc::server
