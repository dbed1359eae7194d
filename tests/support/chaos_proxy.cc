#include "support/chaos_proxy.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <deque>
#include <list>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace partiemc::support {
namespace {

using Clock = std::chrono::steady_clock;

// Capacity of a direction. When it is full, the source must wait, as behind a full router.
constexpr std::size_t kMostHeld = std::size_t{1} << 20;
constexpr std::size_t kPiece = std::size_t{1} << 14;
constexpr int kLongestPollMs = 1000;

sockaddr_in Loopback(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int Checked(int result, const char* what) {
  if (result < 0) throw std::runtime_error(std::string(what) + " failed in the chaos proxy");
  return result;
}

class Socket {
 public:
  explicit Socket(int fd) : fd_(fd) {
    const int yes = 1;
    setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
    fcntl(fd_, F_SETFL, O_NONBLOCK);
  }
  ~Socket() { close(fd_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int fd() const { return fd_; }
  // Makes closing reset the connection.
  void ResetOnClose() {
    const linger at_once{.l_onoff = 1, .l_linger = 0};
    setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  }

 private:
  int fd_;
};

// One direction of a connection: bytes that were read and not written yet.
struct Direction {
  struct Piece {
    Clock::time_point due;
    std::string bytes;
  };
  std::deque<Piece> pieces;
  std::size_t held = 0;
  Clock::time_point free_at{};  // When the rate limit allows the next piece.
  bool ended = false;           // The source has ended.
  bool told = false;            // The sink has been notified of it.
};

struct Connection {
  Connection(int client_fd, int server_fd) : ends{Socket(client_fd), Socket(server_fd)} {}

  std::array<Socket, 2> ends;           // Client, server.
  std::array<Direction, 2> directions;  // From that end to the other.
  bool forgotten = false;               // After HalfOpen.
  bool broken = false;
};

}  // namespace

class ChaosProxy::Loop {
 public:
  explicit Loop(const std::string& target)
      : target_(std::stoi(target.substr(target.rfind(':') + 1))),
        listener_(Checked(socket(AF_INET, SOCK_STREAM, 0), "socket")),
        wake_(Checked(eventfd(0, EFD_NONBLOCK), "eventfd")) {
    sockaddr_in address = Loopback(0);
    socklen_t size = sizeof(address);
    Checked(bind(listener_.fd(), reinterpret_cast<sockaddr*>(&address), size), "bind");
    Checked(listen(listener_.fd(), 128), "listen");
    Checked(getsockname(listener_.fd(), reinterpret_cast<sockaddr*>(&address), &size),
            "getsockname");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Run(); });
  }
  ~Loop() {
    Change([this] { stop_ = true; });
    thread_.join();
    close(wake_);
  }

  int port() const { return port_; }

  // Runs `change` between two rounds of the loop.
  template <typename F>
  void Change(F change) {
    {
      const std::scoped_lock lock(mutex_);
      change();
    }
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(wake_, &one, sizeof(one));
  }
  template <typename F>
  void ForEach(F change) {
    Change([&] { std::for_each(connections_.begin(), connections_.end(), change); });
  }
  template <typename F>
  auto Read(F read) {
    const std::scoped_lock lock(mutex_);
    return read();
  }

  // Guarded by the mutex:
  std::chrono::milliseconds delay{0};
  std::uint64_t limit = 0;
  std::array<std::size_t, 2> to_flip{};  // Pieces from the client, from the server.
  std::uint64_t flipped = 0;
  std::size_t accepted = 0;
  std::list<Connection>& connections() { return connections_; }

 private:
  void Run() {
    std::vector<pollfd> polled;
    for (;;) {
      int timeout = kLongestPollMs;
      {
        const std::scoped_lock lock(mutex_);
        if (stop_) {
          connections_.clear();
          return;
        }
        timeout = Advance();
        polled.assign({{listener_.fd(), POLLIN, 0}, {wake_, POLLIN, 0}});
        for (const Connection& connection : connections_) {
          for (std::size_t end = 0; end < 2; ++end) {
            // poll ignores a negative one; otherwise it would report every closed end.
            const short interest = Interest(connection, end);
            polled.push_back({interest == 0 ? -1 : connection.ends[end].fd(), interest, 0});
          }
        }
      }
      poll(polled.data(), polled.size(), timeout);
      std::uint64_t ignored = 0;
      [[maybe_unused]] const auto read_bytes = read(wake_, &ignored, sizeof(ignored));
      if ((polled[0].revents & POLLIN) != 0) Accept();
    }
  }

  // Events to wait for at an end of a connection.
  static short Interest(const Connection& connection, std::size_t end) {
    if (connection.forgotten) return 0;
    const Direction& in = connection.directions[end];
    const Direction& out = connection.directions[1 - end];
    short events = 0;
    if (!in.ended && in.held < kMostHeld) events = static_cast<short>(events | POLLIN);
    if (!out.pieces.empty() && out.pieces.front().due <= Clock::now()) {
      events = static_cast<short>(events | POLLOUT);
    }
    return events;
  }

  void Accept() {
    const int client = accept(listener_.fd(), nullptr, nullptr);
    if (client < 0) return;
    const int server = Checked(socket(AF_INET, SOCK_STREAM, 0), "socket");
    const sockaddr_in address = Loopback(target_);
    if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
      close(server);
      close(client);
      return;
    }
    const std::scoped_lock lock(mutex_);
    connections_.emplace_back(client, server);
    ++accepted;
  }

  // Moves all bytes that are due; returns the milliseconds until the next ones.
  int Advance() {
    auto next = Clock::now() + std::chrono::milliseconds(kLongestPollMs);
    for (Connection& connection : connections_) {
      if (connection.forgotten) continue;
      for (std::size_t end = 0; end < 2; ++end) {
        Fill(connection, end);
        Drain(connection, end);
        const auto& pieces = connection.directions[end].pieces;
        if (!pieces.empty()) next = std::min(next, pieces.front().due);
      }
      const auto& [up, down] = connection.directions;
      connection.broken |= up.told && down.told;
    }
    connections_.remove_if([](const Connection& connection) { return connection.broken; });
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now()).count();
    return static_cast<int>(std::clamp<std::int64_t>(wait, 0, kLongestPollMs));
  }

  // Reads from an end.
  void Fill(Connection& connection, std::size_t end) {
    Direction& direction = connection.directions[end];
    while (!direction.ended && !connection.broken && direction.held < kMostHeld) {
      std::string bytes(kPiece, '\0');
      const auto count = recv(connection.ends[end].fd(), bytes.data(), bytes.size(), 0);
      if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (count < 0) connection.broken = true;
      if (count <= 0) {
        direction.ended = true;
        return;
      }
      bytes.resize(static_cast<std::size_t>(count));
      if (to_flip[end] > 0) {
        --to_flip[end];
        // A bit in the middle of the piece.
        bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
        ++flipped;
      }
      const auto now = Clock::now();
      auto due = now + delay;
      if (limit > 0) {
        direction.free_at = std::max(direction.free_at, now);
        due = std::max(due, direction.free_at);
        direction.free_at += std::chrono::nanoseconds(bytes.size() * 1'000'000'000 / limit);
      }
      direction.held += bytes.size();
      direction.pieces.push_back({due, std::move(bytes)});
    }
  }

  // Writes due bytes from an end to the other.
  void Drain(Connection& connection, std::size_t end) {
    Direction& direction = connection.directions[end];
    const int sink = connection.ends[1 - end].fd();
    while (!direction.pieces.empty() && direction.pieces.front().due <= Clock::now()) {
      std::string& bytes = direction.pieces.front().bytes;
      const auto count = send(sink, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (count < 0) {
        connection.broken = true;
        return;
      }
      direction.held -= static_cast<std::size_t>(count);
      bytes.erase(0, static_cast<std::size_t>(count));
      if (bytes.empty()) direction.pieces.pop_front();
    }
    if (direction.ended && direction.pieces.empty() && !direction.told) {
      shutdown(sink, SHUT_WR);
      direction.told = true;
    }
  }

  const int target_;
  Socket listener_;
  const int wake_;
  int port_ = 0;
  std::mutex mutex_;
  bool stop_ = false;
  std::list<Connection> connections_;
  std::thread thread_;
};

ChaosProxy::ChaosProxy(const std::string& target) : loop_(std::make_unique<Loop>(target)) {}
ChaosProxy::~ChaosProxy() = default;

std::string ChaosProxy::address() const { return "127.0.0.1:" + std::to_string(loop_->port()); }

void ChaosProxy::Cut() {
  loop_->Change([this] { loop_->connections().clear(); });
}

void ChaosProxy::Reset() {
  loop_->Change([this] {
    for (Connection& connection : loop_->connections()) {
      for (Socket& end : connection.ends) end.ResetOnClose();
    }
    loop_->connections().clear();
  });
}

void ChaosProxy::HalfOpen() {
  loop_->ForEach([](Connection& connection) { connection.forgotten = true; });
}

void ChaosProxy::Flip(std::size_t count, bool from_server) {
  loop_->Change([&] { loop_->to_flip[from_server ? 1 : 0] = count; });
}

void ChaosProxy::Delay(std::chrono::milliseconds delay) {
  loop_->Change([&] { loop_->delay = delay; });
}

void ChaosProxy::Limit(std::uint64_t bytes_per_second) {
  loop_->Change([&] { loop_->limit = bytes_per_second; });
}

std::size_t ChaosProxy::accepted() const {
  return loop_->Read([this] { return loop_->accepted; });
}

std::uint64_t ChaosProxy::flipped() const {
  return loop_->Read([this] { return loop_->flipped; });
}

}  // namespace partiemc::support
