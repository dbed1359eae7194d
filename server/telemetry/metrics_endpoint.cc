#include "server/telemetry/metrics_endpoint.h"

#include <netdb.h>
#include <prometheus/exposer.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

constexpr std::chrono::milliseconds kKnockInterval(5);

// Connects and disconnects.
void Knock(const Address& address) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found) != 0) {
    return;
  }
  const int file = socket(found->ai_family, found->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (file >= 0) {
    connect(file, found->ai_addr, found->ai_addrlen);
    close(file);
  }
  freeaddrinfo(found);
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsEndpoint>> MetricsEndpoint::Listen(
    const Address& address, const std::shared_ptr<Metrics>& metrics) {
  if (!address.unix_path.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat("--metrics ", address.ToString(), ": must be HOST:PORT or [IPV6]:PORT"));
  }
  try {
    // Sets a short request timeout, because a connection without a request must not occupy one of
    // the two threads. Prometheus itself reads every few seconds.
    const std::vector<std::string> options = {
        "listening_ports", address.ToString(), "num_threads", "2", "request_timeout_ms", "5000"};
    auto exposer = std::make_unique<prometheus::Exposer>(options);
    exposer->RegisterCollectable(metrics);
    Address bound = address;
    bound.port = static_cast<std::uint16_t>(exposer->GetListeningPorts().at(0));
    return std::unique_ptr<MetricsEndpoint>(
        new MetricsEndpoint(std::move(bound), std::move(exposer)));
  } catch (const std::exception&) {
    return absl::UnavailableError(absl::StrCat("cannot listen on --metrics ", address.ToString(),
                                               ": is it in use, and is it an address of this "
                                               "machine? Choose another"));
  }
}

MetricsEndpoint::MetricsEndpoint(Address address, std::unique_ptr<prometheus::Exposer> exposer)
    : address_(std::move(address)), exposer_(std::move(exposer)) {}

// The HTTP server checks its stop flag at each new connection and every two seconds. Therefore the
// destructor connects to it, so that it stops at once.
MetricsEndpoint::~MetricsEndpoint() {
  std::atomic<bool> stopped = false;
  std::thread stop([this, &stopped] {
    exposer_.reset();
    stopped = true;
  });
  while (!stopped) {
    Knock(address_);
    std::this_thread::sleep_for(kKnockInterval);
  }
  stop.join();
}

}  // namespace partiemc::server
