// The system calls of the acceptor: sockets that listen, who the peer is, and bytes received.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "common/address.h"
#include "server/connections/connection_ledger.h"

namespace partiemc::server {

/// A file descriptor, closed when this goes out of scope.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Descriptor(std::move(other)).swap(*this);
    return *this;
  }

  int get() const { return number_; }
  int release() { return std::exchange(number_, -1); }
  void swap(Descriptor& other) { std::swap(number_, other.number_); }

 private:
  int number_;
};

struct Listeners {
  std::vector<Descriptor> sockets;
  std::uint16_t port = 0;  ///< The port that was bound; 0 for a Unix socket.
};

/// Listens as gRPC does: on every address of a host's name, on all addresses of IPv4 and IPv6 for
/// 0.0.0.0 and [::], and in place of a Unix socket that is there. `dead_after`: a connection ends
/// if bytes sent are not acknowledged for this time.
/// Errors: UNAVAILABLE with the system's reason.
absl::StatusOr<Listeners> ListenOn(const Address& address, std::chrono::milliseconds dead_after);

struct Peer {
  std::string name;  ///< As NormalPeer writes it; empty for a Unix socket, where peers have none.
  std::string address;  ///< The unit of limits per address: HostOfPeer, or a user of this machine.
};

/// Nothing where the connection is gone already.
std::optional<Peer> PeerOf(int socket);

/// Bytes received, read and sent. False for a socket that does not count them, as Unix sockets do
/// not.
bool ReadByteCounts(int socket, ConnectionReading& reading);

/// Ends a connection at once: the peer receives a reset, and unread bytes are dropped. After
/// shutdown(2) alone gRPC would still read them.
void Abort(int socket);

}  // namespace partiemc::server
