#include "server/base/received_bytes.h"

#include <arpa/inet.h>
#include <dirent.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <optional>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

std::string PeerV4(const in_addr& address, std::uint16_t port) {
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &address, text, sizeof text);
  return absl::StrCat("ipv4:", text, ":", ntohs(port));
}

std::string PeerV6(const in6_addr& address, std::uint16_t port) {
  if (IN6_IS_ADDR_V4MAPPED(&address)) {
    in_addr v4{};
    v4.s_addr = address.s6_addr32[3];
    return PeerV4(v4, port);
  }
  char text[INET6_ADDRSTRLEN] = {};
  inet_ntop(AF_INET6, &address, text, sizeof text);
  return absl::StrCat("ipv6:%5B", text, "%5D:", ntohs(port));
}

// Returns the peer of a socket in gRPC's format, or nothing if the descriptor is no socket of IP.
std::optional<std::string> PeerOf(int file) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (::getpeername(file, reinterpret_cast<sockaddr*>(&address), &size) != 0) return std::nullopt;
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    return PeerV4(v4.sin_addr, v4.sin_port);
  }
  if (address.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
    return PeerV6(v6.sin6_addr, v6.sin6_port);
  }
  return std::nullopt;
}

// Returns the bytes that a TCP connection has received, or nothing if the kernel is too old.
std::optional<std::uint64_t> ReceivedBytesOf(int file) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(file, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return std::nullopt;
  if (size < offsetof(tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received) {
    return std::nullopt;
  }
  return info.tcpi_bytes_received;
}

}  // namespace

std::map<std::string, std::uint64_t> ReceivedBytesOfConnections() {
  std::map<std::string, std::uint64_t> received;
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir("/proc/self/fd"), ::closedir);
  if (folder == nullptr) return received;
  while (const dirent* const entry = ::readdir(folder.get())) {
    if (entry->d_name[0] == '.') continue;
    const int file = std::atoi(entry->d_name);
    auto peer = PeerOf(file);
    if (!peer) continue;
    if (const auto bytes = ReceivedBytesOf(file)) received.emplace(*std::move(peer), *bytes);
  }
  return received;
}

}  // namespace partiemc::server
