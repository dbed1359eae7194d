// System calls on sockets: listening, names of peers, byte counts, aborting a connection.
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

/// A file descriptor, or -1 for none; the destructor closes it.
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

/// Opens listening sockets for `address`, as gRPC itself would:
/// - a host name: every address of this name on which listening succeeds, at least one;
/// - 0.0.0.0 and [::]: all addresses of IPv4 and IPv6;
/// - a Unix socket: replaces the socket file if a crashed server has left one.
///
/// A TCP connection ends if its peer does not acknowledge sent bytes for `dead_after`. Errors:
/// ALREADY_EXISTS if another server listens on one of the addresses; UNAVAILABLE with the system's
/// text if no address can be used.
absl::StatusOr<Listeners> ListenOn(const Address& address, std::chrono::milliseconds dead_after);

struct Peer {
  std::string name;  ///< As NormalPeer writes it; empty for a Unix socket, where peers have none.
  /// The unit of limits per address: HostOfPeer. For a Unix socket, a user: "unix:uid=1000".
  std::string address;
};

/// Returns nothing if the connection has ended.
std::optional<Peer> PeerOf(int socket);

/// Sets the numbers of bytes received, read and sent in `reading`; never decreases them. Returns
/// false if the socket does not count bytes (Unix sockets).
bool ReadByteCounts(int socket, ConnectionReading& reading);

/// Ends a connection at once: the peer receives a reset, and unread bytes are dropped. After
/// shutdown(2) alone, gRPC would still read the unread bytes.
void Abort(int socket);

}  // namespace partiemc::server
