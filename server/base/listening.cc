#include "server/base/listening.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

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

absl::Status CheckUnix(const Address& address) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::memcpy(name.sun_path, address.unix_path.data(), address.unix_path.size());
  const Socket probe(AF_UNIX);
  if (connect(probe.descriptor(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)) == 0) {
    return CannotListen(address, "another server listens there");
  }
  if (errno == ECONNREFUSED) return absl::OkStatus();  // A stale file; the acceptor replaces it.
  if (errno != ENOENT) return CannotListen(address, ErrorText(errno));
  const Socket socket(AF_UNIX);
  if (bind(socket.descriptor(), reinterpret_cast<const sockaddr*>(&name), sizeof(name)) != 0) {
    return CannotListen(address, ErrorText(errno));
  }
  unlink(address.unix_path.c_str());
  return absl::OkStatus();
}

absl::Status CheckTcp(const Address& address) {
  const auto found = ResolveToListen(address);
  if (!found.ok()) return CannotListen(address, std::string(found.status().message()));
  // Like gRPC, accepts one working address of several, unless the port is in use on another.
  int error = 0;
  bool any = false;
  for (const addrinfo* candidate = found->get(); candidate != nullptr;
       candidate = candidate->ai_next) {
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

absl::StatusOr<ResolvedAddresses> ResolveToListen(const Address& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failure =
      getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found);
  if (failure != 0) return absl::UnavailableError(gai_strerror(failure));
  return ResolvedAddresses(found, &freeaddrinfo);
}

absl::Status CheckCanListen(const Address& address) {
  return address.unix_path.empty() ? CheckTcp(address) : CheckUnix(address);
}

}  // namespace partiemc::server
