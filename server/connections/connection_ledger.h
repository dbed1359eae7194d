// Detects a flood in a connection: compares the bytes that the connection received with the bytes
// that its calls and messages need.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

namespace partiemc::server {

/// Limits of one connection. The defaults are the limits of a server without options.
struct ConnectionRules {
  /// Maximum of the received bytes that belong to no call and no message, less 16 KiB for each
  /// second (ConnectionLedger). gRPC 1.51 uses up to 40 bytes of memory for each of them; the worst
  /// case is headers of four bytes. 0: no limit, and no Flood::kHeaders.
  std::uint64_t unaccounted_bytes = std::uint64_t{512} << 10;
  /// Maximum size of a message.
  std::uint64_t max_message_bytes = std::uint64_t{64} << 20;
  /// Maximum number of open HTTP/2 streams. The same limit applies to streams that have not become
  /// calls, such as streams that the client resets at once. Their count decays by `max_streams` in
  /// five seconds. Each stream needs 10 to 22 kB. 0: no limit.
  std::uint64_t max_streams = 1'000;
  /// Unaccounted bytes up to which a connection is never a suspect. Before the server begins the
  /// first call of a usual client, the client can send 64 KiB (the initial window of HTTP/2) and
  /// its headers.
  std::uint64_t usual_bytes = std::uint64_t{80} << 10;
};

/// Measurements of a connection by the operating system and gRPC. All values except `streams_open`
/// only increase.
struct ConnectionReading {
  std::uint64_t bytes_received = 0;
  std::uint64_t bytes_read = 0;  ///< Received bytes that gRPC has read from the socket.
  std::uint64_t bytes_sent = 0;  ///< Acknowledged by the peer.
  std::uint64_t streams_started = 0;
  std::uint64_t streams_open = 0;
  std::uint64_t messages = 0;  ///< Complete messages, whether or not their call has read them.
  bool has_streams = false;    ///< Whether the three values above are known and current.
};

/// Why a connection is cut.
enum class Flood {
  kUnaccountedBytes,  ///< Too many bytes that belong to no call and no message.
  kStreams,           ///< Too many concurrent streams.
  kHeaders,           ///< A header block without an end.
};

/// Returns a text for the log, such as "unaccounted bytes".
std::string_view FloodName(Flood flood);

/// Keeps account of the bytes of one connection.
///
/// The flow control of HTTP/2 limits DATA frames (by the number of open calls) but no other frames.
/// Therefore the ledger keeps a debt: the received bytes minus credits for calls, messages, replies
/// and time, at least zero. Open and recently ended calls allow some bytes in flight. A connection
/// is a flood if its debt exceeds this allowance by more than `unaccounted_bytes`.
///
/// Within this allowance, a client with an open call could send a header block that never ends. In
/// gRPC's counts, such a block appears as an open stream that is not a call. While the counts show
/// such a stream, and no stream begins and no message ends, the ledger counts every byte that gRPC
/// reads as part of the header block. These bytes get no credit and no allowance.
///
/// The methods `On...`, Take and the counts of calls are thread-safe. One thread uses the rest.
class ConnectionLedger {
 public:
  using Clock = std::chrono::steady_clock;

  ConnectionLedger(const ConnectionRules& rules, Clock::time_point now);

  void OnCallBegun();
  void OnReadBegun() { reads_open_.fetch_add(1, std::memory_order_relaxed); }
  /// A read has completed with a message of `bytes`.
  void OnReadDone(std::uint64_t bytes);
  /// A call has ended. `reading`: a read of the call was still pending.
  void OnCallEnded(bool reading);

  /// Counts of the connection's calls.
  struct Counts {
    std::uint64_t calls_begun = 0, calls_open = 0, reads_open = 0;
    std::uint64_t credit = 0;  ///< Sum of the credits for calls and messages, in bytes.
    std::uint64_t ended = 0;   ///< Sum of the allowances of ended calls, in bytes.
  };
  Counts Take() const;

  /// Updates the account. Returns the kind of flood if the connection is a flood. Requires:
  /// `counts` was taken before `reading` was measured, so `reading` includes all bytes of the
  /// messages in `counts`.
  std::optional<Flood> Examine(const Counts& counts, const ConnectionReading& reading,
                               Clock::time_point now);

  /// The debt in excess of the allowance, in bytes, at the last call of Examine.
  std::uint64_t excess() const { return excess_; }
  /// The larger of two numbers at the last reading with `has_streams`: open streams, and streams
  /// that have not become calls.
  std::uint64_t streams() const { return streams_; }
  /// Whether `excess` or `streams` exceeds a sixth of its limit. An `excess` of at most
  /// `usual_bytes` is no suspicion.
  bool IsSuspect() const;
  std::uint64_t calls_open() const { return calls_open_.load(std::memory_order_relaxed); }
  std::uint64_t calls_begun() const { return calls_begun_.load(std::memory_order_relaxed); }
  /// Whether an open stream was not a call, at the last reading with `has_streams`. If so, the
  /// counts of streams should be read again soon.
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

  // Used by Examine only:
  Clock::time_point examined_;
  Counts last_counts_;
  ConnectionReading last_;
  double debt_ = 0;       // Bytes.
  double lingering_ = 0;  // Remaining allowance of ended calls, in bytes.
  std::uint64_t excess_ = 0, streams_ = 0;
  // Number of streams that have not become calls (it decays), and the counts of its last update.
  double waiting_streams_ = 0;
  std::uint64_t counted_started_ = 0, counted_begun_ = 0;
  bool headers_pending_ = false;
  Clock::time_point pending_since_;
  std::uint64_t pending_stream_ = 0, pending_messages_ = 0, pending_bytes_ = 0;
};

}  // namespace partiemc::server
