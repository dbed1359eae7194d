// A client of HTTP/2 over plain TCP that keeps to no rule by itself: enough to speak gRPC badly on
// purpose. Frames are queued, so that several of them leave in one packet.
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

/// The code of RST_STREAM for a call that its client cancels.
inline constexpr std::uint32_t kCancel = 8;

using Headers = std::vector<std::pair<std::string, std::string>>;

/// HPACK: literals without indexing and without Huffman codes.
std::string HeaderBlock(const Headers& headers);

/// An integer of HPACK behind the bits of `first` that its prefix leaves.
std::string HpackInteger(std::uint8_t first, int prefix_bits, std::uint64_t value);

/// What gRPC wants of a call of `path` ("/package.Service/Method"), and `more`.
Headers CallHeaders(std::string_view path, const Headers& more = {});

/// A message as gRPC sends it: a byte, its length, itself.
std::string Prefixed(std::string_view message);
/// The beginning of a message of that many bytes.
std::string MessagePrefix(std::uint32_t bytes);

/// A frame that came from the server.
struct ReceivedFrame {
  FrameType type;
  std::uint8_t flags;
  std::uint32_t stream;
  std::string_view payload;  ///< Valid during the call of the handler only.

  bool EndsStream() const {
    return type == FrameType::kReset ||
           ((type == FrameType::kData || type == FrameType::kHeaders) && (flags & kEndStream) != 0);
  }
};

/// The number behind `grpc-status` in a header block; -1 where it has none. Works because the
/// server is told to keep no table of headers.
int GrpcStatusOf(std::string_view header_block);

class Http2Client {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    /// What the server may send on a stream before it is allowed more.
    std::uint32_t stream_window = 0x7fffffff;
    /// Whether the connection's preface and settings are queued.
    bool greet = true;
    /// The address that the client connects from; empty: any.
    std::string source = {};
    /// TLS with ALPN "h2". The server's certificate is not verified.
    bool tls = false;
  };

  /// Connects to "127.0.0.1:PORT". Throws std::runtime_error where that fails.
  explicit Http2Client(const std::string& address) : Http2Client(address, Options{}) {}
  Http2Client(const std::string& address, const Options& options);
  ~Http2Client();
  Http2Client(const Http2Client&) = delete;
  Http2Client& operator=(const Http2Client&) = delete;

  // What leaves with the next Flush:
  void Bytes(std::string_view bytes) { out_ += bytes; }
  void Frame(FrameType type, std::uint8_t flags, std::uint32_t stream, std::string_view payload);
  /// HEADERS of a new stream, whose number it gives.
  std::uint32_t Call(const Headers& headers, std::uint8_t flags = kEndHeaders);
  std::uint32_t CallBlock(std::string_view block, std::uint8_t flags = kEndHeaders);
  /// DATA in frames of at most 16 KiB, whatever the window.
  void Data(std::uint32_t stream, std::string_view bytes, bool end_stream = false);
  void Reset(std::uint32_t stream, std::uint32_t code = kCancel);
  void Setting(std::uint16_t name, std::uint32_t value);
  void Ping(std::uint64_t word);
  void WindowUpdate(std::uint32_t stream, std::uint32_t bytes);
  void GoAway();

  /// DATA that the server lets this stream send now.
  std::int64_t WindowOf(std::uint32_t stream) const;
  std::size_t queued() const { return out_.size(); }

  /// Sends what is queued; reads meanwhile, unless told not to. False once the connection has ended
  /// or after `time`.
  bool Flush(std::chrono::milliseconds time, bool read = true);
  /// Sends what is queued, then DATA as the server's windows allow. False as Flush.
  bool SendData(std::uint32_t stream, std::string_view bytes, bool end_stream,
                std::chrono::milliseconds time);
  /// Reads and passes on what comes until `done` or the end of the time or of the connection; gives
  /// what `done` says at last. Acknowledges settings and pings, and allows the connection more.
  bool Read(std::chrono::milliseconds time, const std::function<bool()>& done = nullptr);

  /// For each frame that comes.
  void OnFrame(std::function<void(const ReceivedFrame&)> handler) { handler_ = std::move(handler); }

  /// Ended by the server or by Close.
  bool closed() const { return closed_; }
  /// The connection is cut: a reset (the process was killed with data unread) or in order.
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
  std::int64_t window_ = 65'535, first_window_ = 65'535;  // Of the connection; of a new stream.
  std::map<std::uint32_t, std::int64_t> windows_;         // Changes against first_window_.
  std::uint64_t unacknowledged_ = 0;                      // Received DATA.
  std::function<void(const ReceivedFrame&)> handler_;
};

}  // namespace partiemc::attack
