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

/// Owns the listening sockets. Passes each accepted connection to a ConnectionWatch and, unless the
/// watch refuses it, to gRPC.
class Acceptor {
 public:
  /// Function that takes over the descriptor of a connection. It may block (HandOverThreads).
  using HandOver = std::function<void(int descriptor)>;

  /// Opens the listening sockets. Accepts no connection before Start. `watch` outlives the
  /// acceptor. A TCP connection ends if its peer does not acknowledge sent bytes for `dead_after`.
  /// Errors: UNAVAILABLE if it cannot listen.
  static absl::StatusOr<std::unique_ptr<Acceptor>> Listen(const Address& address,
                                                          std::chrono::milliseconds dead_after,
                                                          ConnectionWatch& watch);
  /// Stops listening. Ends the connections that wait for their hand-over, and waits until every
  /// call of the hand-over function has returned.
  ~Acceptor();
  Acceptor(const Acceptor&) = delete;
  Acceptor& operator=(const Acceptor&) = delete;

  std::uint16_t port() const { return port_; }

  void Start(HandOver hand_over);

  /// Closes the listening sockets and deletes a Unix socket's file. New connections are refused.
  void StopListening();

 private:
  Acceptor(Address address, Listeners listeners, ConnectionWatch& watch);
  void Run();
  bool AcceptAll(int listener);

  const Address address_;
  const std::uint16_t port_;
  ConnectionWatch& watch_;
  std::vector<Descriptor> sockets_;  // Used by thread_ only, after Start.
  const Descriptor wake_;
  std::unique_ptr<HandOverThreads> hand_over_;
  std::thread thread_;
};

}  // namespace partiemc::server
