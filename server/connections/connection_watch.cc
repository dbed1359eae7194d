#include "server/connections/connection_watch.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Interval of examinations. The shorter interval applies while 1 to kMostInAlert connections are
// not quiet. It is short because gRPC can begin 50 calls in a millisecond.
constexpr milliseconds kPeriod(20), kAlertPeriod(5);
constexpr std::size_t kMostInAlert = 64;
constexpr seconds kNew(1);
// Number of quiet connections that are examined in each kPeriod. A connection is quiet if it is
// older than kNew, and has neither an excess nor pending headers.
constexpr std::size_t kQuietInPeriod = 128;
// Limits the reading of stream counts: gRPC returns them as text, which takes 20 us. The counts of
// a connection are read again after gRPC has read this number of bytes from it, or one second after
// the last count if gRPC has read any. While headers are pending, they are also read after
// kPendingBetweenCounts. A stream needs at least 22 bytes, so at most 750 streams are not counted
// yet.
constexpr std::uint64_t kBytesBetweenCounts = 16 << 10;
constexpr std::size_t kCountsInPeriod = 64;
constexpr milliseconds kPendingBetweenCounts(500);

// Limits of connections that may only make health checks: number per address, total number, and
// duration.
constexpr std::size_t kHealthOnlyOfAddress = 8;
constexpr std::size_t kHealthOnly = 64;
constexpr seconds kHealthOnlyTime(5);
// A connection that may only make health checks ends after this time if it has made another call,
// whose refusal arrives in the meantime.
constexpr milliseconds kMisusedTime(500);
// Limits of one connection that may only make health checks: unaccounted bytes, number of streams.
constexpr std::uint64_t kHealthOnlyBytes = 16 << 10;
constexpr std::uint64_t kHealthOnlyStreams = 16;
// A connection that may only make health checks is passed to gRPC after this delay. It is ended
// instead if the peer has sent more than kFirstBytes by then. A health check sends fewer bytes
// before its first reply. So a flooding peer that reconnects costs little.
constexpr milliseconds kHealthOnlyDelay(20);
constexpr std::uint64_t kFirstBytes = 4 << 10;

constexpr seconds kBetweenForgetting(1);
constexpr std::uint32_t kLinesPerSecond = 10;

constexpr std::uint64_t kWakeKey = 0;  // Key of wake_ in epoll; connections have larger keys.

ConnectionRules RulesOf(Admission admission, ConnectionRules rules) {
  if (admission == Admission::kKept) return rules;
  return {.unaccounted_bytes = kHealthOnlyBytes,
          .max_message_bytes = 0,
          .max_streams = kHealthOnlyStreams};
}

}  // namespace

ConnectionWatch::ConnectionWatch(const ConnectionLimits& limits, const ConnectionRules& rules,
                                 ConnectionTable& table)
    : rules_(rules),
      table_(table),
      events_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      counts_(limits),
      log_limit_(kLinesPerSecond),
      health_only_log_limit_(kLinesPerSecond) {
  epoll_event event{.events = EPOLLIN, .data = {.u64 = kWakeKey}};
  epoll_ctl(events_.get(), EPOLL_CTL_ADD, wake_.get(), &event);
}

ConnectionWatch::~ConnectionWatch() {
  stop_ = true;
  eventfd_write(wake_.get(), 1);
  if (thread_.joinable()) thread_.join();
  const MutexLock lock(mutex_);
  while (!connections_.empty()) {
    Abort(connections_.front().socket.get());
    Remove(connections_.begin());
  }
}

void ConnectionWatch::Start(StreamCounter* streams) {
  streams_ = streams;
  thread_ = std::thread([this] { Run(); });
}

void ConnectionWatch::Add(Descriptor socket, const HandOver& hand_over) {
  auto peer = PeerOf(socket.get());
  Connection connection;
  const auto duplicate = [&socket] { return fcntl(socket.get(), F_DUPFD_CLOEXEC, 0); };
  connection.socket = Descriptor(duplicate());
  // The accepted connection may have taken the last free descriptor.
  if (connection.socket.get() < 0 && EvictIdle()) connection.socket = Descriptor(duplicate());
  if (!peer || connection.socket.get() < 0) return;
  connection.peer = *std::move(peer);
  const std::string& address = connection.peer.address;
  const auto now = Clock::now();
  const MutexLock lock(mutex_);
  if (counts_.IsFull()) EvictIdleLocked();
  const Admission admission = counts_.Add(address, now);
  if (admission == Admission::kRefused) return Abort(socket.get());
  connection.tracked =
      std::make_shared<TrackedConnection>(RulesOf(admission, rules_), admission, now);
  if (!connection.peer.name.empty() && !table_.Add(connection.peer.name, connection.tracked)) {
    counts_.Remove(address, admission);
    return;
  }
  ++counters_.accepted;
  if (admission == Admission::kHealthOnly) {
    ++counters_.health_only;
    if (health_only_log_limit_.Allow(now)) {
      LogEvent(spdlog::level::warn, "connection may only make health checks",
               {{"peer", connection.peer.name.empty() ? address : connection.peer.name},
                {"reason", "too many connections, too many new ones, or a flood of this address"}});
    }
    EvictHealthOnly(address);
    connection.waiting = std::move(socket);
    connection.hand_over = hand_over;
  }
  connection.key = ++next_key_;
  connection.came = connection.counted = now;
  connection.counts_bytes = ReadByteCounts(connection.socket.get(), connection.reading);
  epoll_event event{.events = EPOLLRDHUP | EPOLLET, .data = {.u64 = connection.key}};
  epoll_ctl(events_.get(), EPOLL_CTL_ADD, connection.socket.get(), &event);
  if (connections_.empty()) eventfd_write(wake_.get(), 1);
  connections_.push_back(std::move(connection));
  by_key_.emplace(connections_.back().key, std::prev(connections_.end()));
  count_ = connections_.size();
  if (admission == Admission::kKept) hand_over(std::move(socket));
}

void ConnectionWatch::EndWaiting() {
  const MutexLock lock(mutex_);
  for (auto next = connections_.begin(); next != connections_.end();) {
    const auto connection = next++;
    if (connection->waiting.get() < 0) continue;
    Abort(connection->socket.get());
    Remove(connection);
  }
}

void ConnectionWatch::EndAllAt(Clock::time_point deadline) {
  const MutexLock lock(mutex_);
  end_all_at_ = deadline;
  eventfd_write(wake_.get(), 1);
}

void ConnectionWatch::Run() {
  pthread_setname_np(pthread_self(), "connections");
  while (!stop_) {
    HandleEvents(TimeToWait(Clock::now()));
    const auto now = Clock::now();
    const MutexLock lock(mutex_);
    if (now >= end_all_at_) {
      while (!connections_.empty()) {
        Abort(connections_.front().socket.get());
        Remove(connections_.begin());
      }
    }
    if (now >= examine_at_) ExamineAll(now);
    if (now >= forget_at_) {
      counts_.Forget(now);
      forget_at_ = now + kBetweenForgetting;
    }
  }
}

// Returns the timeout for epoll_wait in milliseconds; -1: no timeout.
int ConnectionWatch::TimeToWait(Clock::time_point now) {
  const MutexLock lock(mutex_);
  if (connections_.empty() && counts_.addresses() == 0) return -1;
  const auto next = connections_.empty() ? forget_at_ : examine_at_;
  const auto wait = std::chrono::ceil<milliseconds>(std::min(next, end_all_at_) - now);
  return static_cast<int>(
      std::clamp(wait, milliseconds(1), milliseconds(kBetweenForgetting)).count());
}

void ConnectionWatch::HandleEvents(int timeout_ms) {
  std::array<epoll_event, 64> events;
  const int count =
      epoll_wait(events_.get(), events.data(), static_cast<int>(events.size()), timeout_ms);
  const MutexLock lock(mutex_);
  for (int k = 0; k < count; ++k) {
    const auto& event = events[static_cast<std::size_t>(k)];
    const std::uint64_t key = event.data.u64;  // A copy, because epoll_event is packed.
    if (key == kWakeKey) {
      eventfd_t ignored = 0;
      eventfd_read(wake_.get(), &ignored);
    } else if ((event.events & (EPOLLHUP | EPOLLERR)) != 0) {
      // gRPC or the peer has ended the connection. Removes it here too, because the kernel frees
      // the connection only when this duplicate descriptor is closed.
      const auto found = by_key_.find(key);
      if (found != by_key_.end()) Remove(found->second);
    }
  }
}

std::vector<ExaminedConnection> ConnectionWatch::Examined() const {
  std::vector<ExaminedConnection> examined;
  examined.reserve(connections_.size());
  for (const Connection& connection : connections_) {
    examined.push_back({connection.tracked.get(), &connection.peer.address});
  }
  return examined;
}

bool ConnectionWatch::EvictIdle() {
  const MutexLock lock(mutex_);
  return EvictIdleLocked();
}

bool ConnectionWatch::EvictIdleLocked() {
  const auto idle = IdleOfLargestAddress(Examined(), counts_);
  if (!idle) return false;
  const auto connection = std::next(connections_.begin(), static_cast<std::ptrdiff_t>(*idle));
  ++counters_.evicted;
  shutdown(connection->socket.get(), SHUT_RDWR);
  Remove(connection);
  return true;
}

// Makes room for a new health-only connection of `address`. If the address has reached its limit,
// ends its oldest health-only connection. Otherwise, if all addresses together have reached their
// limit, ends the oldest health-only connection.
void ConnectionWatch::EvictHealthOnly(const std::string& address) {
  const auto is_health_only = [](const Connection& connection) {
    return connection.tracked->admission == Admission::kHealthOnly;
  };
  std::size_t of_address = 0, all = 0;
  for (const Connection& connection : connections_) {
    if (!is_health_only(connection)) continue;
    ++all;
    of_address += connection.peer.address == address ? 1 : 0;
  }
  const bool own = of_address >= kHealthOnlyOfAddress;
  if (!own && all < kHealthOnly) return;
  const auto oldest = std::find_if(connections_.begin(), connections_.end(), [&](const auto& one) {
    return is_health_only(one) && (!own || one.peer.address == address);
  });
  Abort(oldest->socket.get());
  Remove(oldest);
}

// Examines all connections that are not quiet. Once in each period also examines up to
// kQuietInPeriod of the quiet connections, in turn.
void ConnectionWatch::ExamineAll(Clock::time_point now) {
  counts_left_ = kCountsInPeriod;
  const bool is_period = now >= all_at_;
  std::size_t index = 0, alerting = 0;
  for (auto next = connections_.begin(); next != connections_.end(); ++index) {
    const auto connection = next++;
    const ConnectionLedger& ledger = connection->tracked->ledger;
    const bool alerts =
        ledger.excess() > 0 || ledger.headers_pending() || now - connection->came < kNew;
    alerting += alerts ? 1 : 0;
    if (alerts || (is_period && IsTurn(index))) Examine(connection, now);
  }
  ExamineTogether(now);
  if (is_period) {
    turn_ = connections_.empty() ? 0 : (turn_ + kQuietInPeriod) % connections_.size();
    all_at_ = now + kPeriod;
  }
  examine_at_ = alerting > 0 && alerting <= kMostInAlert ? now + kAlertPeriod : all_at_;
}

bool ConnectionWatch::IsTurn(std::size_t index) const {
  const std::size_t count = connections_.size();
  return count <= kQuietInPeriod || (index + count - turn_) % count < kQuietInPeriod;
}

void ConnectionWatch::Examine(Connections::iterator connection, Clock::time_point now) {
  TrackedConnection& tracked = *connection->tracked;
  const auto counts = tracked.ledger.Take();
  ConnectionReading& reading = connection->reading;
  if (connection->counts_bytes) ReadByteCounts(connection->socket.get(), reading);
  if (tracked.admission == Admission::kHealthOnly && !ExamineHealthOnly(*connection, now)) {
    Abort(connection->socket.get());
    Remove(connection);
    return;
  }
  reading.has_streams = CountStreams(*connection, now);
  if (const auto flood = tracked.ledger.Examine(counts, reading, now)) {
    Cut(connection, *flood, now);
  }
}

// Returns false if the connection must end. Passes it to gRPC after kHealthOnlyDelay.
bool ConnectionWatch::ExamineHealthOnly(Connection& connection, Clock::time_point now) {
  const auto time = now - connection.came;
  if (connection.tracked->misused && !connection.misused) connection.misused = now;
  if (connection.misused && now - *connection.misused >= kMisusedTime) return false;
  if (time > kHealthOnlyTime) return false;
  if (connection.tracked->ledger.calls_begun() > kHealthOnlyStreams) return false;
  if (connection.waiting.get() < 0) return true;
  if (connection.reading.bytes_received > kFirstBytes) return false;
  if (time >= kHealthOnlyDelay)
    std::exchange(connection.hand_over, {})(std::move(connection.waiting));
  return true;
}

bool ConnectionWatch::CountStreams(Connection& connection, Clock::time_point now) {
  if (streams_ == nullptr || counts_left_ == 0 || connection.peer.name.empty()) return false;
  const std::uint64_t bytes = connection.reading.bytes_read - connection.bytes_at_count;
  const auto time = now - connection.counted;
  const bool pending = connection.tracked->ledger.headers_pending();
  if (bytes < kBytesBetweenCounts && !(pending && time > kPendingBetweenCounts) &&
      !(bytes > 0 && time > seconds(1))) {
    return false;
  }
  --counts_left_;
  connection.bytes_at_count = connection.reading.bytes_read;
  connection.counted = now;
  return streams_->Read(connection.peer.name, connection.grpc_socket, connection.reading);
}

void ConnectionWatch::ExamineTogether(Clock::time_point now) {
  while (const auto excess = LargestExcess(Examined(), rules_)) {
    Cut(std::next(connections_.begin(), static_cast<std::ptrdiff_t>(excess->index)), excess->flood,
        now);
  }
  CutSuspects(now);
}

// Cuts the suspects of the addresses that flood. Otherwise an address could flood on several
// connections, each below its own limit. Spares connections that may only make health checks: they
// hold little, and OnFlood would refuse the next health check of their address.
void ConnectionWatch::CutSuspects(Clock::time_point now) {
  if (flooding_.empty()) return;
  for (auto next = connections_.begin(); next != connections_.end();) {
    const auto connection = next++;
    const auto found = flooding_.find(connection->peer.address);
    const TrackedConnection& tracked = *connection->tracked;
    if (found == flooding_.end() || tracked.admission == Admission::kHealthOnly ||
        !tracked.ledger.IsSuspect()) {
      continue;
    }
    Cut(connection, found->second, now);
  }
  flooding_.clear();
}

void ConnectionWatch::Cut(Connections::iterator connection, Flood flood, Clock::time_point now) {
  const Connection& cut = *connection;
  Abort(cut.socket.get());
  ++counters_.floods[static_cast<std::size_t>(flood)];
  counts_.OnFlood(cut.peer.address, cut.tracked->admission, now);
  if (counts_.bans()) flooding_[cut.peer.address] = flood;
  if (log_limit_.Allow(now)) {
    LogEvent(spdlog::level::warn, "connection cut",
             {{"peer", cut.peer.name.empty() ? cut.peer.address : cut.peer.name},
              {"reason", std::string(FloodName(flood))},
              {"received", cut.reading.bytes_read},
              {"unaccounted", cut.tracked->ledger.excess()},
              {"streams", cut.tracked->ledger.streams()},
              {"calls", cut.tracked->ledger.calls_begun()}});
  }
  Remove(connection);
}

void ConnectionWatch::Remove(Connections::iterator connection) {
  epoll_ctl(events_.get(), EPOLL_CTL_DEL, connection->socket.get(), nullptr);
  if (!connection->peer.name.empty()) table_.Remove(connection->peer.name);
  counts_.Remove(connection->peer.address, connection->tracked->admission);
  by_key_.erase(connection->key);
  connections_.erase(connection);
  count_ = connections_.size();
}

}  // namespace partiemc::server
