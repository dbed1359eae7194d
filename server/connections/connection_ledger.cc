#include "server/connections/connection_ledger.h"

#include <algorithm>

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// HTTP/2 frame headers and TLS records add up to an eighth (1/kOverheadPart) to the size of a
// message: proxies use frames of only 1 kB.
constexpr std::uint64_t kOverheadPart = 8;
// Overhead of each message that does not depend on its size, in bytes.
constexpr std::uint64_t kMessageOverhead = 256;
// Overhead of a call in bytes: usual headers, the end of the stream, and window updates.
constexpr std::uint64_t kCallOverhead = 1'024;
// A client acknowledges the bytes that the server sends by WINDOW_UPDATE frames. Usually these
// frames have a thousandth of the sent bytes; a sixteenth is allowed.
constexpr std::uint64_t kReplyPart = 16;
// Minimum of the bytes that a pending read allows, unless messages must be empty (maximum size 0).
// A message of up to twice the maximum size is received completely, so that the error can state its
// size. A still larger message cuts the connection.
constexpr std::uint64_t kLeastReadAllowance = std::uint64_t{64} << 20;
// Bytes that each second allows for PING and SETTINGS frames, which belong to no call.
constexpr double kBytesPerSecond = 16 * 1'024;
// Bytes that a call may have in flight before the server reads them: the flow-control windows of
// the call and of its connection.
constexpr std::uint64_t kWindowBytes = 320 << 10;
// After a call has ended, bytes of it may still arrive for this time.
constexpr double kLingerSeconds = 5;
// Limits the allowance of all ended calls together: this number of windows plus one message.
constexpr std::uint64_t kLingeringWindows = 64;

// A client sends a header block without pauses. If a stream has not become a call after this time,
// and gRPC has read more than `unaccounted_bytes`, its header block has no end.
constexpr milliseconds kHeaderTime(100);
// Longer time that applies if gRPC has read fewer bytes. gRPC itself has no time limit for header
// blocks.
constexpr std::chrono::seconds kSlowHeaderTime(10);

// A connection above 1/kSuspectPart of a limit is a suspect.
constexpr std::uint64_t kSuspectPart = 6;

std::uint64_t OnTheWire(std::uint64_t bytes) {
  return bytes + bytes / kOverheadPart + kMessageOverhead;
}

}  // namespace

std::string_view FloodName(Flood flood) {
  switch (flood) {
    case Flood::kUnaccountedBytes:
      return "unaccounted bytes";
    case Flood::kStreams:
      return "too many streams";
    case Flood::kHeaders:
      return "headers without an end";
  }
  return "";
}

ConnectionLedger::ConnectionLedger(const ConnectionRules& rules, Clock::time_point now)
    : rules_(rules), examined_(now), pending_since_(now) {}

void ConnectionLedger::OnCallBegun() {
  credit_.fetch_add(kCallOverhead, std::memory_order_relaxed);
  calls_open_.fetch_add(1, std::memory_order_relaxed);
  calls_begun_.fetch_add(1, std::memory_order_relaxed);
}

void ConnectionLedger::OnReadDone(std::uint64_t bytes) {
  credit_.fetch_add(OnTheWire(bytes), std::memory_order_relaxed);
  reads_open_.fetch_sub(1, std::memory_order_relaxed);
}

void ConnectionLedger::OnCallEnded(bool reading) {
  ended_.fetch_add(kWindowBytes + (reading ? ReadAllowance() : 0), std::memory_order_relaxed);
  if (reading) reads_open_.fetch_sub(1, std::memory_order_relaxed);
  calls_open_.fetch_sub(1, std::memory_order_relaxed);
}

ConnectionLedger::Counts ConnectionLedger::Take() const {
  return {.calls_begun = calls_begun_.load(std::memory_order_relaxed),
          .calls_open = calls_open_.load(std::memory_order_relaxed),
          .reads_open = reads_open_.load(std::memory_order_relaxed),
          .credit = credit_.load(std::memory_order_relaxed),
          .ended = ended_.load(std::memory_order_relaxed)};
}

std::uint64_t ConnectionLedger::ReadAllowance() const {
  if (rules_.max_message_bytes == 0) return OnTheWire(0);
  return OnTheWire(std::max(2 * rules_.max_message_bytes, kLeastReadAllowance));
}

std::optional<Flood> ConnectionLedger::Examine(const Counts& counts,
                                               const ConnectionReading& reading,
                                               Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now - examined_).count();
  PayDebt(counts, reading, seconds);
  CountStreams(counts, reading, seconds);
  const double allowed =
      static_cast<double>(counts.calls_open * kWindowBytes + counts.reads_open * ReadAllowance()) +
      lingering_;
  excess_ = static_cast<std::uint64_t>(std::max(0.0, debt_ - allowed));
  examined_ = now;
  last_counts_ = counts;
  last_ = reading;
  if (rules_.max_streams > 0 && streams_ > rules_.max_streams) return Flood::kStreams;
  if (rules_.unaccounted_bytes == 0) return std::nullopt;
  if (excess_ > rules_.unaccounted_bytes) return Flood::kUnaccountedBytes;
  return ExamineHeaders(counts, reading, now);
}

bool ConnectionLedger::IsSuspect() const {
  const auto exceeds = [](std::uint64_t value, std::uint64_t limit) {
    return limit > 0 && value > limit / kSuspectPart;
  };
  return (excess_ > rules_.usual_bytes && exceeds(excess_, rules_.unaccounted_bytes)) ||
         exceeds(streams_, rules_.max_streams);
}

// Updates the debt. Adds received bytes before it subtracts credits: the debt never becomes
// negative, so the other order could lose credits.
void ConnectionLedger::PayDebt(const Counts& counts, const ConnectionReading& reading,
                               double seconds) {
  debt_ += static_cast<double>(reading.bytes_received - last_.bytes_received);
  const double most = static_cast<double>(ReadAllowance() + kLingeringWindows * kWindowBytes);
  lingering_ = std::min(most, lingering_ + static_cast<double>(counts.ended - last_counts_.ended));
  // The allowance of ended calls decays. The decayed part is also subtracted from the debt, because
  // the late bytes of these calls have raised the debt when they arrived.
  const double forgiven = lingering_ * std::min(1.0, seconds / kLingerSeconds);
  lingering_ -= forgiven;
  debt_ -= static_cast<double>(counts.credit - last_counts_.credit) + forgiven +
           static_cast<double>((reading.bytes_sent - last_.bytes_sent) / kReplyPart) +
           kBytesPerSecond * seconds;
  debt_ = std::max(0.0, debt_);
}

// Counts the streams that have not become calls. A stream that the client has reset is no longer
// open, but gRPC holds memory for it until it becomes a call. Some streams never become calls, so
// the count decays.
void ConnectionLedger::CountStreams(const Counts& counts, const ConnectionReading& reading,
                                    double seconds) {
  const double forgiven = static_cast<double>(rules_.max_streams) * seconds / kLingerSeconds;
  waiting_streams_ = std::max(0.0, waiting_streams_ - forgiven);
  if (!reading.has_streams) return;
  // streams_started decreases if the counts were first those of an earlier connection from the same
  // port.
  waiting_streams_ += static_cast<double>(reading.streams_started) -
                      static_cast<double>(counted_started_) -
                      static_cast<double>(counts.calls_begun - counted_begun_);
  waiting_streams_ = std::max(0.0, waiting_streams_);
  counted_started_ = reading.streams_started;
  counted_begun_ = counts.calls_begun;
  streams_ = std::max(reading.streams_open, static_cast<std::uint64_t>(waiting_streams_));
}

std::optional<Flood> ConnectionLedger::ExamineHeaders(const Counts& counts,
                                                      const ConnectionReading& reading,
                                                      Clock::time_point now) {
  if (!reading.has_streams) return std::nullopt;
  headers_pending_ = reading.streams_open > counts.calls_open;
  // Within a header block no other stream begins and no message ends. So if either happens, the
  // pending stream is no longer suspected of an endless header block, and the measurement restarts.
  if (!headers_pending_ || reading.streams_started != pending_stream_ ||
      reading.messages != pending_messages_) {
    pending_since_ = now;
    pending_stream_ = reading.streams_started;
    pending_messages_ = reading.messages;
    pending_bytes_ = reading.bytes_read;
    return std::nullopt;
  }
  const std::uint64_t bytes = reading.bytes_read - pending_bytes_;
  const auto time = now - pending_since_;
  if ((time >= kHeaderTime && bytes > rules_.unaccounted_bytes) ||
      (time >= kSlowHeaderTime && bytes > 0)) {
    return Flood::kHeaders;
  }
  return std::nullopt;
}

}  // namespace partiemc::server
