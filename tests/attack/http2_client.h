// An HTTP/2 client over TCP that enforces no rules, for malformed gRPC. Frames are queued, so that
// several can share a packet.
#pragma once

#include <openssl/ssl.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace partiemc::attack {

enum class FrameType : std::uint8_t {
  kData = 0,
  kHeaders = 1,
  kPriority = 2,
  kReset = 3,
  kSettings = 4,
  kPing = 6,
  kGoAway = 7,
  kWindowUpdate = 8,
  kContinuation = 9,
};

inline constexpr std::uint8_t kEndStream = 0x1;
inline constexpr std::uint8_t kAck = 0x1;
inline constexpr std::uint8_t kEndHeaders = 0x4;

/// RST_STREAM code of a cancelled call.
inline constexpr std::uint32_t kCancel = 8;

using Headers = std::vector<std::pair<std::string, std::string>>;

/// Encodes HPACK literals without indexing and Huffman codes.
std::string HeaderBlock(const Headers& headers);

/// Encodes an HPACK integer after the bits of `first` before its prefix.
std::string HpackInteger(std::uint8_t first, int prefix_bits, std::uint64_t value);

/// Headers that gRPC requires for a call of `path` ("/package.Service/Method"), and `more`.
Headers CallHeaders(std::string_view path, const Headers& more = {});

/// A message in gRPC's framing: a byte, its length, itself.
std::string Prefixed(std::string_view message);
/// The framing of a message of `bytes` bytes.
std::string MessagePrefix(std::uint32_t bytes);

/// A frame from the server.
struct ReceivedFrame {
  FrameType type;
  std::uint8_t flags;
  std::uint32_t stream;
  std::string_view payload;  ///< Valid during the handler only.

  bool EndsStream() const {
    return type == FrameType::kReset ||
           ((type == FrameType::kData || type == FrameType::kHeaders) && (flags & kEndStream) != 0);
  }
};

/// The value of `grpc-status` in a header block; -1 if absent. Requires that the server uses no
/// header table.
int GrpcStatusOf(std::string_view header_block);

class Http2Client {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    /// Bytes that the server may send on a stream before an update of its window.
    std::uint32_t stream_window = 0x7fffffff;
    /// Queue preface and settings of the connection.
    bool greet = true;
    /// Source address of the client; empty: any.
    std::string source = {};
    /// TLS with ALPN "h2". The server's certificate is not verified.
    bool tls = false;
  };

  /// Connects to "127.0.0.1:PORT". Throws std::runtime_error on failure.
  explicit Http2Client(const std::string& address) : Http2Client(address, Options{}) {}
  Http2Client(const std::string& address, const Options& options);
  ~Http2Client();
  Http2Client(const Http2Client&) = delete;
  Http2Client& operator=(const Http2Client&) = delete;

  // Queued for the next Flush:
  void Bytes(std::string_view bytes) { out_ += bytes; }
  void Frame(FrameType type, std::uint8_t flags, std::uint32_t stream, std::string_view payload);
  /// HEADERS of a new stream; returns its number.
  std::uint32_t Call(const Headers& headers, std::uint8_t flags = kEndHeaders);
  std::uint32_t CallBlock(std::string_view block, std::uint8_t flags = kEndHeaders);
  /// DATA in frames of at most 16 KiB, ignoring the window.
  void Data(std::uint32_t stream, std::string_view bytes, bool end_stream = false);
  void Reset(std::uint32_t stream, std::uint32_t code = kCancel);
  void Setting(std::uint16_t name, std::uint32_t value);
  void Ping(std::uint64_t word);
  void WindowUpdate(std::uint32_t stream, std::uint32_t bytes);
  void GoAway();

  /// DATA bytes that the server currently allows on this stream.
  std::int64_t WindowOf(std::uint32_t stream) const;
  std::size_t queued() const { return out_.size(); }

  /// Sends the queue, and reads during that time unless `read` is false. False if the connection
  /// has ended or `time` has passed.
  bool Flush(std::chrono::milliseconds time, bool read = true);
  /// Sends the queue, then DATA within the server's windows. False as for Flush.
  bool SendData(std::uint32_t stream, std::string_view bytes, bool end_stream,
                std::chrono::milliseconds time);
  /// Reads frames until `done`, the end of the connection or `time`; returns the last value of
  /// `done`. Acknowledges settings and pings, and extends the windows.
  bool Read(std::chrono::milliseconds time, const std::function<bool()>& done = nullptr);

  /// Sets the handler of received frames.
  void OnFrame(std::function<void(const ReceivedFrame&)> handler) { handler_ = std::move(handler); }

  /// True after the server's end or Close.
  bool closed() const { return closed_; }
  /// Closes the connection, with a reset (like a killed process with unread data) or cleanly.
  void Close(bool reset);

 private:
  struct FreeTls {
    void operator()(SSL* tls) const { SSL_free(tls); }
  };

  void StartTls();
  bool WriteSome();
  bool ReadSome();
  std::int64_t ReadBytes(char* buffer, std::size_t bytes);
  void Receive(const ReceivedFrame& frame);
  short Wait(short events, Clock::time_point deadline) const;

  int socket_ = -1;
  std::unique_ptr<SSL, FreeTls> tls_;  // Null: in the clear.
  bool closed_ = false;
  std::string out_, in_;
  std::uint32_t next_stream_ = 1;
  std::int64_t window_ = 65'535,
               first_window_ = 65'535;             // Windows of the connection and of a new stream.
  std::map<std::uint32_t, std::int64_t> windows_;  // Differences from first_window_.
  std::uint64_t unacknowledged_ = 0;               // Received DATA.
  std::function<void(const ReceivedFrame&)> handler_;
};

}  // namespace partiemc::attack
