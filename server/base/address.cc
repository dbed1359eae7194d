#include "server/base/address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <system_error>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

constexpr char kUnixScheme[] = "unix:";

class Socket {
 public:
  Socket(int family) : descriptor_(socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

std::string ErrorText(int error) { return std::generic_category().message(error); }

absl::Status CannotListen(const Address& address, const std::string& why) {
  return absl::UnavailableError(absl::StrCat("cannot listen on ", address.ToString(), ": ", why,
                                             "; choose another --address"));
}

absl::StatusOr<std::uint16_t> ParsePort(const std::string& text, const std::string& whole) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, port);
  if (text.empty() || parsed != end || error != std::errc()) {
    return absl::InvalidArgumentError(absl::StrCat("address \"", whole, "\": the port \"", text,
                                                   "\" must be a number from 0 to 65535"));
  }
  return port;
}

absl::StatusOr<Address> ParseUnix(const std::string& text) {
  Address address;
  address.unix_path = text.substr(sizeof(kUnixScheme) - 1);
  // gRPC takes unix:///path too.
  if (absl::StartsWith(address.unix_path, "//")) address.unix_path.erase(0, 2);
  if (address.unix_path.empty() || address.unix_path.size() >= sizeof(sockaddr_un::sun_path)) {
    return absl::InvalidArgumentError(absl::StrCat("address \"", text,
                                                   "\": the path of a Unix socket must have 1 to ",
                                                   sizeof(sockaddr_un::sun_path) - 1, " bytes"));
  }
  return address;
}

absl::Status CheckUnix(const Address& address) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, address.unix_path.data(), address.unix_path.size());
  const Socket probe(AF_UNIX);
  if (connect(probe.descriptor(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)) == 0) {
    return CannotListen(address, "another server listens there");
  }
  if (errno == ECONNREFUSED) return absl::OkStatus();  // Left behind; gRPC replaces it.
  if (errno != ENOENT) return CannotListen(address, ErrorText(errno));
  const Socket socket(AF_UNIX);
  if (bind(socket.descriptor(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)) != 0) {
    return CannotListen(address, ErrorText(errno));
  }
  unlink(address.unix_path.c_str());
  return absl::OkStatus();
}

absl::Status CheckTcp(const Address& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failure =
      getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
  if (failure != 0) return CannotListen(address, gai_strerror(failure));
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  // One address of several is enough, as it is for gRPC; only a port that is taken is not.
  int error = 0;
  bool any = false;
  for (const addrinfo* candidate = found; candidate != nullptr; candidate = candidate->ai_next) {
    const Socket socket(candidate->ai_family);
    const int yes = 1;
    setsockopt(socket.descriptor(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    const bool listens =
        bind(socket.descriptor(), candidate->ai_addr, candidate->ai_addrlen) == 0 &&
        listen(socket.descriptor(), 1) == 0;
    any = any || listens;
    if (!listens && (error == 0 || errno == EADDRINUSE)) error = errno;
  }
  if (!any || error == EADDRINUSE) return CannotListen(address, ErrorText(error));
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckCanListen(const Address& address) {
  return address.unix_path.empty() ? CheckTcp(address) : CheckUnix(address);
}

bool Address::IsLocal() const {
  if (!unix_path.empty() || host == "localhost") return true;
  in_addr four{};
  if (inet_pton(AF_INET, host.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24 == 127;
  in6_addr six{};
  return inet_pton(AF_INET6, host.c_str(), &six) == 1 && IN6_IS_ADDR_LOOPBACK(&six) != 0;
}

std::string Address::ToString() const {
  if (!unix_path.empty()) return absl::StrCat(kUnixScheme, unix_path);
  const bool bracketed = absl::StrContains(host, ":");
  return absl::StrCat(bracketed ? "[" : "", host, bracketed ? "]" : "", ":", port);
}

absl::StatusOr<Address> ParseAddress(const std::string& text) {
  if (absl::StartsWith(text, kUnixScheme)) return ParseUnix(text);
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("address \"", text, "\": must be HOST:PORT, [IPV6]:PORT or unix:PATH"));
  }
  Address address;
  address.host = text.substr(0, colon);
  const bool bracketed = address.host.front() == '[' && address.host.back() == ']';
  if (bracketed) address.host = address.host.substr(1, address.host.size() - 2);
  if (address.host.empty() || (!bracketed && absl::StrContains(address.host, ":"))) {
    return absl::InvalidArgumentError(
        absl::StrCat("address \"", text, "\": must be HOST:PORT, [IPV6]:PORT or unix:PATH"));
  }
  const auto port = ParsePort(text.substr(colon + 1), text);
  if (!port.ok()) return port.status();
  address.port = *port;
  return address;
}

}  // namespace partiemc::server
