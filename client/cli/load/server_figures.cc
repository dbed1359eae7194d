#include "client/cli/load/server_figures.h"

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "client/output/text.h"
#include "common/text.h"

namespace partiemc::client {
namespace {

// Returns the number that follows `name` at the beginning of a line of `text`.
std::optional<double> ValueOf(std::string_view text, std::string_view name) {
  const std::string begin = Concat("\n", name, " ");
  const auto at = text.find(begin);
  if (at == std::string_view::npos) return std::nullopt;
  text.remove_prefix(at + begin.size());
  return ConsumeNumber<double>(text);
}

// Connects to the first address of `host` that accepts. Returns the descriptor, or -1. The timeout
// is five seconds for each attempt to connect, and later for each send and receive. The name lookup
// has no timeout.
int Connect(const std::string& host, const std::string& port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) return -1;
  int file = -1;
  for (const addrinfo* one = found; one != nullptr && file < 0; one = one->ai_next) {
    file = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, 0);
    if (file < 0) continue;
    const timeval limit{.tv_sec = 5, .tv_usec = 0};
    setsockopt(file, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    setsockopt(file, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
    if (connect(file, one->ai_addr, one->ai_addrlen) != 0) {
      close(file);
      file = -1;
    }
  }
  freeaddrinfo(found);
  return file;
}

}  // namespace

std::optional<ServerFigures> FiguresIn(std::string_view text) {
  const auto cpu = ValueOf(text, "process_cpu_seconds_total");
  const auto memory = ValueOf(text, "process_resident_memory_bytes");
  if (!cpu || !memory) return std::nullopt;
  return ServerFigures{*cpu, *memory};
}

absl::StatusOr<ServerFigures> AskFigures(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size()) {
    return absl::InvalidArgumentError(
        Concat("--metrics: '", address, "'; must be HOST:PORT, as the server's --metrics"));
  }
  const int file = Connect(address.substr(0, colon), address.substr(colon + 1));
  if (file < 0) {
    return absl::UnavailableError(
        Concat("no metrics at ", address, "; start the server with --metrics ", address));
  }
  const std::string request =
      Concat("GET /metrics HTTP/1.0\r\nHost: ", address, "\r\nConnection: close\r\n\r\n");
  std::string answer;
  if (send(file, request.data(), request.size(), MSG_NOSIGNAL) ==
      static_cast<ssize_t>(request.size())) {
    char bytes[4096];
    for (ssize_t count; (count = recv(file, bytes, sizeof bytes, 0)) > 0;) {
      answer.append(bytes, static_cast<std::size_t>(count));
    }
  }
  close(file);
  if (const auto figures = FiguresIn(answer)) return *figures;
  return absl::DataLossError(
      Concat("what answers at ", address, " is no partiemc-server's metrics"));
}

}  // namespace partiemc::client
