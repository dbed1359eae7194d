// Tells a flood in one connection from its calls: the bytes received against the bytes of messages.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

namespace partiemc::server {

/// Limits of one connection. Defaults are for a server without options.
struct ConnectionRules {
  /// Bytes of a connection that no call and no message accounts for. gRPC 1.51 takes up to 40 bytes
  /// of memory for each of them (headers of four bytes). 0: not limited.
  std::uint64_t unaccounted_bytes = std::uint64_t{512} << 10;
  /// Of one message.
  std::uint64_t max_message_bytes = std::uint64_t{64} << 20;
  /// HTTP/2 streams that exist in gRPC at once, and streams that have not become calls yet, such as
  /// those that were reset at once. Each takes 10 to 16 kB. 0: not limited.
  std::uint64_t max_streams = 1'000;
};

/// Values that the system and gRPC report of a connection. All but `streams_open` only grow.
struct ConnectionReading {
  std::uint64_t bytes_received = 0;
  std::uint64_t bytes_read = 0;  ///< Without those that wait in the kernel.
  std::uint64_t bytes_sent = 0;  ///< Acknowledged by the peer.
  std::uint64_t streams_started = 0;
  std::uint64_t streams_open = 0;
  std::uint64_t messages = 0;  ///< Complete ones, whether their call has read them or not.
  bool has_streams = false;    ///< Whether the three values above are known and of this moment.
};

/// Why a connection is cut.
enum class Flood {
  kUnaccountedBytes,  ///< More bytes than its calls and messages account for.
  kStreams,           ///< More streams at once than it may have.
  kHeaders,           ///< A block of headers without an end.
};

/// For the log: "unaccounted bytes".
std::string_view FloodName(Flood flood);

/// The account of one connection. DATA is bounded by HTTP/2's windows, and so by the calls that are
/// open; every other frame is not. So the ledger keeps a debt: bytes received, less the credits of
/// calls, messages and replies, never below zero. A connection is a flood when its debt exceeds the
/// bytes that its open calls may have under way by more than `unaccounted_bytes`.
///
/// A client with an open call could hide a block of headers without an end in the bytes that the
/// call allows. Such a block is a stream of gRPC that never becomes a call: where this state lasts,
/// the bytes that gRPC reads meanwhile count in full.
///
/// Calls report from any thread. Examine is for one thread.
class ConnectionLedger {
 public:
  using Clock = std::chrono::steady_clock;

  ConnectionLedger(const ConnectionRules& rules, Clock::time_point now);

  void OnCallBegun();
  void OnReadBegun() { reads_open_.fetch_add(1, std::memory_order_relaxed); }
  /// A read has brought a message of `bytes`.
  void OnReadDone(std::uint64_t bytes);
  /// `reading`: a read that was begun is not over.
  void OnCallEnded(bool reading);

  /// Counts of calls, to be taken before the reading that they are compared with: what a call has
  /// reported was received before.
  struct Counts {
    std::uint64_t calls_begun = 0, calls_open = 0, reads_open = 0;
    std::uint64_t credit = 0;  ///< Bytes that calls and messages account for.
    std::uint64_t ended = 0;   ///< Bytes that ended calls had allowed.
  };
  Counts Take() const;

  /// Whether the connection is a flood. `counts` is of before `reading`.
  std::optional<Flood> Examine(const Counts& counts, const ConnectionReading& reading,
                               Clock::time_point now);

  /// Bytes beyond what open calls allow, as of the last Examine.
  std::uint64_t excess() const { return excess_; }
  /// Streams that are open or have not become calls, as of the last reading that had them.
  std::uint64_t streams() const { return streams_; }
  std::uint64_t calls_open() const { return calls_open_.load(std::memory_order_relaxed); }
  std::uint64_t calls_begun() const { return calls_begun_.load(std::memory_order_relaxed); }
  /// Whether a stream has not become a call: then its streams are worth another look.
  bool headers_pending() const { return headers_pending_; }

 private:
  std::uint64_t ReadAllowance() const;
  void PayDebt(const Counts& counts, const ConnectionReading& reading, double seconds);
  void CountStreams(const Counts& counts, const ConnectionReading& reading, double seconds);
  std::optional<Flood> ExamineHeaders(const Counts& counts, const ConnectionReading& reading,
                                      Clock::time_point now);

  const ConnectionRules rules_;

  std::atomic<std::uint64_t> calls_begun_ = 0, calls_open_ = 0, reads_open_ = 0;
  std::atomic<std::uint64_t> credit_ = 0, ended_ = 0;

  // Of Examine alone.
  Clock::time_point examined_;
  Counts last_counts_;
  ConnectionReading last_;
  double debt_ = 0;       // Bytes.
  double lingering_ = 0;  // Bytes that ended calls still allow.
  std::uint64_t excess_ = 0, streams_ = 0;
  // Streams that have not become calls, and the counts that they were computed from.
  double waiting_streams_ = 0;
  std::uint64_t counted_started_ = 0, counted_begun_ = 0;
  bool headers_pending_ = false;
  Clock::time_point pending_since_;
  std::uint64_t pending_stream_ = 0, pending_messages_ = 0, pending_bytes_ = 0;
};

}  // namespace partiemc::server
