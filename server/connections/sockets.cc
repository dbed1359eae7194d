#include "server/connections/sockets.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "server/security/peer_accounts.h"

namespace partiemc::server {
namespace {

constexpr int kBacklog = 4'096;

// Converts an error of listening: ALREADY_EXISTS if the address is in use, otherwise UNAVAILABLE.
// The message is the system's text.
absl::Status ListenError(int error) {
  const std::string why = std::generic_category().message(error);
  return error == EADDRINUSE ? absl::AlreadyExistsError(why) : absl::UnavailableError(why);
}

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = sizeof(sockaddr_storage);

  sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
  int family() const { return storage.ss_family; }
  sockaddr_in6& v6() { return reinterpret_cast<sockaddr_in6&>(storage); }
  sockaddr_in& v4() { return reinterpret_cast<sockaddr_in&>(storage); }
  std::uint16_t port() { return ntohs(family() == AF_INET6 ? v6().sin6_port : v4().sin_port); }
  void set_port(std::uint16_t port) {
    (family() == AF_INET6 ? v6().sin6_port : v4().sin_port) = htons(port);
  }
};

void SetOption(int socket, int level, int name, int value) {
  setsockopt(socket, level, name, &value, sizeof(value));
}

absl::StatusOr<Descriptor> Listen(SocketAddress address, std::chrono::milliseconds dead_after) {
  Descriptor socket(::socket(address.family(), SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (socket.get() < 0) return ListenError(errno);
  if (address.family() != AF_UNIX) {
    // Accepted connections inherit these options.
    SetOption(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
    SetOption(socket.get(), IPPROTO_TCP, TCP_NODELAY, 1);
    SetOption(socket.get(), IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(dead_after.count()));
    if (address.family() == AF_INET6) SetOption(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, 0);
  }
  if (bind(socket.get(), address.get(), address.size) != 0 || listen(socket.get(), kBacklog) != 0) {
    return ListenError(errno);
  }
  return socket;
}

absl::StatusOr<Listeners> ListenOnPath(const std::string& path,
                                       std::chrono::milliseconds dead_after) {
  SocketAddress address;
  auto& name = reinterpret_cast<sockaddr_un&>(address.storage);
  name.sun_family = AF_UNIX;
  if (path.size() >= sizeof(name.sun_path)) return absl::UnavailableError("the path is too long");
  std::memcpy(name.sun_path, path.data(), path.size());
  address.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + 1);
  const Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (connect(probe.get(), address.get(), address.size) == 0) {
    return absl::AlreadyExistsError("another server listens there");
  }
  struct stat file {};
  if (errno == ECONNREFUSED && stat(path.c_str(), &file) == 0 && S_ISSOCK(file.st_mode)) {
    unlink(path.c_str());  // The socket of a server that has crashed.
  }
  auto socket = Listen(address, dead_after);
  if (!socket.ok()) return socket.status();
  Listeners listeners;
  listeners.sockets.push_back(*std::move(socket));
  return listeners;
}

absl::StatusOr<std::vector<SocketAddress>> Resolve(const Address& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failure =
      getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
  if (failure != 0) return absl::UnavailableError(gai_strerror(failure));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, &freeaddrinfo);
  std::vector<SocketAddress> all;
  for (const addrinfo* next = found; next != nullptr; next = next->ai_next) {
    SocketAddress one;
    std::memcpy(&one.storage, next->ai_addr, next->ai_addrlen);
    one.size = next->ai_addrlen;
    const bool is_known = std::ranges::any_of(all, [&](const SocketAddress& known) {
      return std::memcmp(&known.storage, &one.storage, sizeof(one.storage)) == 0;
    });
    if (!is_known) all.push_back(one);
  }
  return all;
}

// If `address` means all addresses (0.0.0.0 or [::]), returns [::], whose socket also accepts IPv4.
// Returns nothing for other addresses.
std::optional<SocketAddress> BothFamilies(SocketAddress address) {
  const bool any = address.family() == AF_INET ? address.v4().sin_addr.s_addr == htonl(INADDR_ANY)
                                               : IN6_IS_ADDR_UNSPECIFIED(&address.v6().sin6_addr);
  if (!any) return std::nullopt;
  SocketAddress both;
  both.v6().sin6_family = AF_INET6;
  both.v6().sin6_port = htons(address.port());
  both.size = sizeof(sockaddr_in6);
  return both;
}

Peer PeerOfUnix(int socket) {
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return {"", "unix"};
  return {"", absl::StrCat("unix:uid=", credentials.uid)};
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

absl::StatusOr<Listeners> ListenOn(const Address& address, std::chrono::milliseconds dead_after) {
  if (!address.unix_path.empty()) return ListenOnPath(address.unix_path, dead_after);
  auto candidates = Resolve(address);
  if (!candidates.ok()) return candidates.status();
  if (const auto both = BothFamilies(candidates->front())) {
    if (auto socket = Listen(*both, dead_after); socket.ok()) candidates = std::vector{*both};
  }
  Listeners listeners;
  absl::Status error;
  for (SocketAddress& candidate : *candidates) {
    if (listeners.port != 0) candidate.set_port(listeners.port);
    auto socket = Listen(candidate, dead_after);
    if (!socket.ok()) {
      // With port 0 the system chooses the port for the first address. Another program may use this
      // port on the second address; this is not an error.
      if (address.port != 0 && absl::IsAlreadyExists(socket.status())) return socket.status();
      error.Update(socket.status());
      continue;
    }
    SocketAddress bound;
    getsockname(socket->get(), bound.get(), &bound.size);
    listeners.port = bound.port();
    listeners.sockets.push_back(*std::move(socket));
  }
  if (listeners.sockets.empty()) return error;
  return listeners;
}

std::optional<Peer> PeerOf(int socket) {
  SocketAddress peer;
  if (getpeername(socket, peer.get(), &peer.size) != 0) return std::nullopt;
  if (peer.family() == AF_UNIX) return PeerOfUnix(socket);
  std::array<char, INET6_ADDRSTRLEN> text{};
  std::string name;
  if (peer.family() == AF_INET6 && !IN6_IS_ADDR_V4MAPPED(&peer.v6().sin6_addr)) {
    inet_ntop(AF_INET6, &peer.v6().sin6_addr, text.data(), text.size());
    name = absl::StrCat("ipv6:[", text.data(), "]:", peer.port());
  } else {
    const void* const address = peer.family() == AF_INET6
                                    ? static_cast<const void*>(&peer.v6().sin6_addr.s6_addr[12])
                                    : static_cast<const void*>(&peer.v4().sin_addr);
    inet_ntop(AF_INET, address, text.data(), text.size());
    name = absl::StrCat("ipv4:", text.data(), ":", peer.port());
  }
  std::string host = HostOfPeer(name);
  return Peer{std::move(name), std::move(host)};
}

bool ReadByteCounts(int socket, ConnectionReading& reading) {
  tcp_info info{};
  socklen_t size = sizeof(info);
  if (getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 ||
      size < offsetof(tcp_info, tcpi_bytes_received) + sizeof(info.tcpi_bytes_received)) {
    return false;
  }
  int waiting = 0;
  if (ioctl(socket, SIOCINQ, &waiting) != 0 || waiting < 0) waiting = 0;
  // Takes the maximum with the previous values. Otherwise a count could decrease: bytes may arrive
  // between the two system calls, and Abort resets the kernel's counts.
  const std::uint64_t received = info.tcpi_bytes_received;
  const auto unread = static_cast<std::uint64_t>(waiting);
  reading.bytes_received = std::max(reading.bytes_received, received);
  reading.bytes_read = std::max(reading.bytes_read, received - std::min(received, unread));
  reading.bytes_sent = std::max<std::uint64_t>(reading.bytes_sent, info.tcpi_bytes_acked);
  return true;
}

void Abort(int socket) {
  // Resets a TCP connection and drops its unread bytes. Unlike close, this works although gRPC also
  // holds the socket.
  const sockaddr nobody{.sa_family = AF_UNSPEC, .sa_data = {}};
  if (connect(socket, &nobody, sizeof(nobody)) == 0) return;
  shutdown(socket, SHUT_RDWR);
  std::array<char, 1 << 16> dropped;
  while (recv(socket, dropped.data(), dropped.size(), MSG_DONTWAIT) > 0) {
  }
}

}  // namespace partiemc::server
