// Bytes of a client to a running gateway: requests, bodies in chunks, and messages of WebSocket
// calls.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/targets.h"
#include "server/calls/methods.h"
#include "server/calls/surface_level.h"
#include "server/compute/compute_pool.h"
#include "server/compute/memory_budget.h"
#include "server/compute/state_memory.h"
#include "server/relay/finished_streams.h"
#include "server/security/authentication.h"
#include "server/security/checkpoint_keys.h"
#include "server/stream/opening_calls.h"
#include "server/stream/stream_registry.h"
#include "server/stream/unary_registry.h"
#include "server/telemetry/metrics.h"
#include "server/watch/level_queue.h"
#include "server/watch/result_history.h"
#include "server/watch/watch_dispatcher.h"
#include "server/watch/watch_registry.h"
#include "server/web/web_gateway.h"

namespace partiemc::fuzz {
namespace {

using std::chrono::milliseconds;

// A gateway on loopback, without gRPC.
class Served {
 public:
  Served()
      : gateway_(*server::WebGateway::Start(
            {.address = {.host = "127.0.0.1", .port = 0, .unix_path = {}}},
            {.methods = methods_,
             .limits = limits_,
             .metrics = metrics_,
             .draining = [] { return false; },
             .ping_interval = std::chrono::seconds(15),
             .ping_timeout = std::chrono::seconds(10)})) {}

  std::uint16_t port() const { return static_cast<std::uint16_t>(gateway_->address().port); }
  bool HoldsNothing() const {
    return budget_.held() == 0 && budget_.planned() == 0 && streams_.OpenCount() == 0;
  }

 private:
  const server::ServerLimits limits_{.frame = {.max_particles = 2'000, .max_tiles = 64},
                                     .max_frame_bytes = 1 << 20,
                                     .max_streams = 4,
                                     .frames_in_flight = 2};
  server::Metrics metrics_;
  server::Authentication authentication_;
  server::CurrentCheckpointKeys keys_;
  server::HistoryRoom history_{0, 0};
  server::OpeningCalls opening_{8};
  server::StreamRegistry streams_{limits_.max_streams};
  server::FinishedStreams finished_;
  server::UnaryRegistry unary_calls_{8};
  server::WatchRegistry watchers_{4};
  server::WatchDispatcher dispatcher_;
  server::MemoryBudget budget_{std::uint64_t{64} << 20};
  server::StateMemory states_{std::uint64_t{16} << 20, std::uint64_t{64} << 10};
  server::ComputePool pool_{1};
  const std::shared_ptr<server::LevelQueue> levels_ = std::make_shared<server::LevelQueue>(
      dispatcher_,
      [this](const server::LevelQueue::Frame& exact, const LevelOfDetail& level,
             const std::atomic<bool>& cancelled) {
        return server::MakeResultLevel(exact, level, cancelled, budget_);
      },
      server::LevelQueue::Limits{});
  const server::ServerContext context_{.limits = limits_,
                                       .authentication = authentication_,
                                       .checkpoint_keys = keys_,
                                       .history = history_,
                                       .opening = opening_,
                                       .streams = streams_,
                                       .finished = finished_,
                                       .unary_calls = unary_calls_,
                                       .watchers = watchers_,
                                       .dispatcher = dispatcher_,
                                       .levels = *levels_,
                                       .budget = budget_,
                                       .states = states_,
                                       .pool = pool_};
  const server::Methods methods_{context_, metrics_};
  const std::unique_ptr<server::WebGateway> gateway_;
};

class Connection {
 public:
  explicit Connection(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{20, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    const linger reset{.l_onoff = 1, .l_linger = 0};  // No port stays in TIME_WAIT.
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    Require(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0,
            "the gateway accepts a connection");
  }
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// False if the gateway has closed the connection, or does not read.
  bool Send(std::string_view bytes) {
    while (!bytes.empty()) {
      const auto sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }
  /// Reads up to the end of a header, or of the connection.
  std::string ReadHeader() {
    std::string text;
    char byte;
    while (!text.ends_with("\r\n\r\n") && Receive(&byte, 1) == 1) text += byte;
    return text;
  }
  /// Sends nothing more, and reads until the gateway closes the connection. Returns the first
  /// bytes.
  std::string ReadToEnd() {
    ::shutdown(socket_, SHUT_WR);
    std::string first;
    char buffer[4096];
    while (true) {
      const auto count = Receive(buffer, sizeof buffer);
      Require(count >= 0 || errno == ECONNRESET, "a connection ends after its client");
      if (count <= 0) return first;
      if (first.size() < 16) first.append(buffer, static_cast<std::size_t>(count));
    }
  }

 private:
  // libFuzzer's timer interrupts calls that wait.
  ssize_t Receive(char* buffer, std::size_t size) {
    ssize_t count = -1;
    do {
      count = ::recv(socket_, buffer, size, 0);
    } while (count < 0 && errno == EINTR);
    return count;
  }

  const int socket_;
};

std::string Header(std::string_view line, std::uint16_t port, std::string_view more) {
  return std::string(line) + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n" +
         std::string(more) + "\r\n";
}

std::string Handshake(std::string_view path, std::uint16_t port) {
  return Header("GET " + std::string(path), port,
                "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Protocol: partiemc.v1\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
}

// A masked frame of WebSocket with a mask of zeros.
std::string WebSocketFrame(std::uint8_t first, std::string_view payload) {
  std::string frame(1, static_cast<char>(first));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80 | payload.size());
  } else {
    frame += static_cast<char>(0xfe);
    frame += static_cast<char>(payload.size() >> 8);
    frame += static_cast<char>(payload.size() & 0xff);
  }
  return frame.append(4, '\0').append(payload);
}

void SendMessages(Connection& connection, Choices choices) {
  static constexpr std::uint8_t kFirst[] = {0x82, 0x02, 0x80, 0x00, 0x81, 0x88, 0x89, 0x8a, 0xf2};
  while (!choices.empty()) {
    const std::uint8_t first = kFirst[choices.Below(std::size(kFirst))];
    const std::string_view payload = choices.TakeText(choices.Take<std::uint16_t>() & 0x3fff);
    if (!connection.Send(WebSocketFrame(first, payload))) return;
  }
}

void SendBody(Connection& connection, std::uint16_t port, Choices choices) {
  const bool chunked = choices.Flip();
  const std::string length =
      chunked ? "Transfer-Encoding: chunked"
              : "Content-Length: " + std::to_string(choices.Take<std::uint16_t>());
  const std::string type = "\r\nContent-Type: application/x-protobuf\r\n";
  if (!connection.Send(Header("POST /v1/frame", port, length + type))) return;
  while (!choices.empty()) {
    const std::string_view bytes = choices.TakeText(choices.Take<std::uint16_t>() & 0x3fff);
    std::string chunk(bytes);
    if (chunked) {
      const std::string size(absl::StrCat(absl::Hex(bytes.size())));
      chunk = size + "\r\n" + chunk + "\r\n";
    }
    if (!connection.Send(chunk)) return;
  }
}

void RequireAnswer(std::string_view first) {
  Require(first.empty() || first.starts_with("HTTP/1.1 "), "an answer is one of HTTP");
}

}  // namespace

void AttackGatewayBytes(Bytes bytes) {
  spdlog::set_level(spdlog::level::off);
  static auto* const served = new Served;
  Choices choices(bytes);
  const std::size_t way = choices.Below(4);
  {
    Connection connection(served->port());
    if (way == 0) {
      connection.Send(choices.TakeRest());
      RequireAnswer(connection.ReadToEnd());
    } else if (way == 1) {
      SendBody(connection, served->port(), choices);
      RequireAnswer(connection.ReadToEnd());
    } else {
      const auto path = choices.Flip() ? "/v1/reconstruct" : "/v1/watch";
      connection.Send(Handshake(path, served->port()));
      Require(connection.ReadHeader().starts_with("HTTP/1.1 101 "), "a handshake is accepted");
      way == 2 ? SendMessages(connection, choices) : void(connection.Send(choices.TakeRest()));
      connection.ReadToEnd();
    }
  }
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!served->HoldsNothing()) {
    Require(std::chrono::steady_clock::now() < give_up, "a call that has ended holds nothing");
    usleep(100);
  }
}

}  // namespace partiemc::fuzz
