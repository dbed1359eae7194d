#include "attack/http2_client.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <stdexcept>

namespace partiemc::attack {
namespace {

constexpr char kPreface[] = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr std::size_t kFrameHeader = 9;
constexpr std::size_t kMaxFrame = 16'384;
constexpr std::uint32_t kMostWindow = 0x7fffffff;
constexpr std::uint16_t kSettingTableSize = 1, kSettingWindow = 4;

void AppendBigEndian(std::uint64_t value, int bytes, std::string& out) {
  for (int k = bytes - 1; k >= 0; --k) out += static_cast<char>(value >> (8 * k) & 0xff);
}

std::uint64_t BigEndian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

// True if an operation of TLS continues when the socket is ready. Anything else ends the
// connection.
bool IsWaiting(SSL* tls, int code) {
  const int error = SSL_get_error(tls, code);
  ERR_clear_error();
  return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
}

}  // namespace

std::string HpackInteger(std::uint8_t first, int prefix_bits, std::uint64_t value) {
  const std::uint64_t most = (1u << prefix_bits) - 1;
  if (value < most) return std::string(1, static_cast<char>(first | value));
  std::string out(1, static_cast<char>(first | most));
  for (value -= most; value >= 128; value >>= 7) out += static_cast<char>(value % 128 | 128);
  return out + static_cast<char>(value);
}

std::string HeaderBlock(const Headers& headers) {
  std::string block;
  for (const auto& [name, value] : headers) {
    block += '\0';
    block += HpackInteger(0, 7, name.size()) + name;
    block += HpackInteger(0, 7, value.size()) + value;
  }
  return block;
}

Headers CallHeaders(std::string_view path, const Headers& more) {
  Headers headers = {{":method", "POST"},          {":scheme", "http"},
                     {":path", std::string(path)}, {":authority", "localhost"},
                     {"te", "trailers"},           {"content-type", "application/grpc"}};
  headers.insert(headers.end(), more.begin(), more.end());
  return headers;
}

std::string MessagePrefix(std::uint32_t bytes) {
  std::string prefix(1, '\0');
  AppendBigEndian(bytes, 4, prefix);
  return prefix;
}

std::string Prefixed(std::string_view message) {
  return MessagePrefix(static_cast<std::uint32_t>(message.size())).append(message);
}

int GrpcStatusOf(std::string_view header_block) {
  constexpr std::string_view kName = "grpc-status";
  const auto at = header_block.find(kName);
  if (at == header_block.npos || at + kName.size() + 2 > header_block.size()) return -1;
  const std::string_view rest = header_block.substr(at + kName.size());
  const auto length = std::min<std::size_t>(static_cast<std::uint8_t>(rest[0]), rest.size() - 1);
  int status = -1;
  std::from_chars(rest.data() + 1, rest.data() + 1 + length, status);
  return status;
}

Http2Client::Http2Client(const std::string& address, const Options& options) {
  const auto colon = address.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket_ >= 0 && !options.source.empty()) {
    sockaddr_in from{};
    from.sin_family = AF_INET;
    inet_pton(AF_INET, options.source.c_str(), &from.sin_addr);
    ::bind(socket_, reinterpret_cast<const sockaddr*>(&from), sizeof from);
  }
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    const std::string reason = std::strerror(errno);
    if (socket_ >= 0) ::close(socket_);
    throw std::runtime_error("no connection to " + address + ": " + reason);
  }
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (options.tls) StartTls();
  fcntl(socket_, F_SETFL, fcntl(socket_, F_GETFL) | O_NONBLOCK);
  if (!options.greet) return;
  Bytes(kPreface);
  std::string settings;
  AppendBigEndian(kSettingTableSize, 2, settings);
  AppendBigEndian(0, 4, settings);
  AppendBigEndian(kSettingWindow, 2, settings);
  AppendBigEndian(options.stream_window, 4, settings);
  Frame(FrameType::kSettings, 0, 0, settings);
  WindowUpdate(0, kMostWindow - 65'535);
}

// Waits for the handshake, for a limited time.
void Http2Client::StartTls() {
  static SSL_CTX* const context = [] {
    std::signal(SIGPIPE, SIG_IGN);  // Raised by writes to a connection that was cut.
    SSL_CTX* const made = SSL_CTX_new(TLS_client_method());
    SSL_CTX_set_mode(made, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    static constexpr unsigned char kProtocols[] = {2, 'h', '2'};
    SSL_CTX_set_alpn_protos(made, kProtocols, sizeof kProtocols);
    return made;
  }();
  const timeval patience{5, 0};
  setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  tls_.reset(SSL_new(context));
  SSL_set_fd(tls_.get(), socket_);
  if (SSL_connect(tls_.get()) == 1) return;
  ERR_clear_error();
  ::close(std::exchange(socket_, -1));
  throw std::runtime_error("no TLS handshake");
}

Http2Client::~Http2Client() { Close(false); }

void Http2Client::Frame(FrameType type, std::uint8_t flags, std::uint32_t stream,
                        std::string_view payload) {
  AppendBigEndian(payload.size(), 3, out_);
  AppendBigEndian(static_cast<std::uint8_t>(type), 1, out_);
  AppendBigEndian(flags, 1, out_);
  AppendBigEndian(stream, 4, out_);
  out_ += payload;
}

std::uint32_t Http2Client::Call(const Headers& headers, std::uint8_t flags) {
  return CallBlock(HeaderBlock(headers), flags);
}

std::uint32_t Http2Client::CallBlock(std::string_view block, std::uint8_t flags) {
  const std::uint32_t stream = next_stream_;
  next_stream_ += 2;
  Frame(FrameType::kHeaders, flags, stream, block);
  return stream;
}

void Http2Client::Data(std::uint32_t stream, std::string_view bytes, bool end_stream) {
  do {
    const std::string_view part = bytes.substr(0, kMaxFrame);
    bytes.remove_prefix(part.size());
    Frame(FrameType::kData, end_stream && bytes.empty() ? kEndStream : std::uint8_t{0}, stream,
          part);
    window_ -= static_cast<std::int64_t>(part.size());
    windows_[stream] -= static_cast<std::int64_t>(part.size());
  } while (!bytes.empty());
}

void Http2Client::Reset(std::uint32_t stream, std::uint32_t code) {
  std::string payload;
  AppendBigEndian(code, 4, payload);
  Frame(FrameType::kReset, 0, stream, payload);
  windows_.erase(stream);
}

void Http2Client::Setting(std::uint16_t name, std::uint32_t value) {
  std::string payload;
  AppendBigEndian(name, 2, payload);
  AppendBigEndian(value, 4, payload);
  Frame(FrameType::kSettings, 0, 0, payload);
}

void Http2Client::Ping(std::uint64_t word) {
  std::string payload;
  AppendBigEndian(word, 8, payload);
  Frame(FrameType::kPing, 0, 0, payload);
}

void Http2Client::WindowUpdate(std::uint32_t stream, std::uint32_t bytes) {
  std::string payload;
  AppendBigEndian(bytes, 4, payload);
  Frame(FrameType::kWindowUpdate, 0, stream, payload);
}

void Http2Client::GoAway() { Frame(FrameType::kGoAway, 0, 0, std::string(8, '\0')); }

std::int64_t Http2Client::WindowOf(std::uint32_t stream) const {
  const auto found = windows_.find(stream);
  return std::min(window_, first_window_ + (found == windows_.end() ? 0 : found->second));
}

// The ready events among `events`; 0 after the deadline.
short Http2Client::Wait(short events, Clock::time_point deadline) const {
  if ((events & POLLIN) != 0 && tls_ && SSL_pending(tls_.get()) > 0) return POLLIN;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
  pollfd ready{socket_, events, 0};
  if (::poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(left, 0))) <= 0) return 0;
  return ready.revents;
}

bool Http2Client::WriteSome() {
  std::int64_t sent = 0;
  if (tls_) {
    std::size_t written = 0;
    const int code = SSL_write_ex(tls_.get(), out_.data(), out_.size(), &written);
    if (code != 1 && !IsWaiting(tls_.get(), code)) closed_ = true;
    sent = static_cast<std::int64_t>(written);
  } else {
    sent = ::send(socket_, out_.data(), out_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) closed_ = true;
  }
  if (sent > 0) out_.erase(0, static_cast<std::size_t>(sent));
  return !closed_;
}

// Bytes received; negative where there are none now, 0 at the end of the connection.
std::int64_t Http2Client::ReadBytes(char* buffer, std::size_t bytes) {
  if (!tls_) {
    const auto got = ::recv(socket_, buffer, bytes, MSG_DONTWAIT);
    return got < 0 && errno != EAGAIN && errno != EINTR ? 0 : got;
  }
  std::size_t got = 0;
  const int code = SSL_read_ex(tls_.get(), buffer, bytes, &got);
  if (code == 1) return static_cast<std::int64_t>(got);
  return IsWaiting(tls_.get(), code) ? -1 : 0;
}

bool Http2Client::ReadSome() {
  char buffer[65'536];
  const auto got = ReadBytes(buffer, sizeof buffer);
  if (got == 0) closed_ = true;
  if (got <= 0) return !closed_;
  in_.append(buffer, static_cast<std::size_t>(got));
  std::size_t at = 0;
  while (in_.size() - at >= kFrameHeader) {
    const std::string_view head(in_.data() + at, kFrameHeader);
    const std::size_t length = BigEndian(head.substr(0, 3));
    if (in_.size() - at < kFrameHeader + length) break;
    Receive({static_cast<FrameType>(head[3]), static_cast<std::uint8_t>(head[4]),
             static_cast<std::uint32_t>(BigEndian(head.substr(5)) & kMostWindow),
             std::string_view(in_.data() + at + kFrameHeader, length)});
    at += kFrameHeader + length;
  }
  in_.erase(0, at);
  return true;
}

void Http2Client::Receive(const ReceivedFrame& frame) {
  switch (frame.type) {
    case FrameType::kSettings:
      if ((frame.flags & kAck) != 0) break;
      for (auto rest = frame.payload; rest.size() >= 6; rest.remove_prefix(6)) {
        if (BigEndian(rest.substr(0, 2)) != kSettingWindow) continue;
        first_window_ = static_cast<std::int64_t>(BigEndian(rest.substr(2, 4)));
      }
      Frame(FrameType::kSettings, kAck, 0, "");
      break;
    case FrameType::kPing:
      if ((frame.flags & kAck) == 0) Frame(FrameType::kPing, kAck, 0, frame.payload);
      break;
    case FrameType::kWindowUpdate: {
      const auto more = static_cast<std::int64_t>(BigEndian(frame.payload) & kMostWindow);
      (frame.stream == 0 ? window_ : windows_[frame.stream]) += more;
      break;
    }
    case FrameType::kData:
      unacknowledged_ += frame.payload.size();
      if (unacknowledged_ > kMostWindow / 4) {
        WindowUpdate(0, static_cast<std::uint32_t>(std::exchange(unacknowledged_, 0)));
      }
      break;
    default:
      break;
  }
  if (handler_) handler_(frame);
  if (frame.EndsStream()) windows_.erase(frame.stream);
}

bool Http2Client::Flush(std::chrono::milliseconds time, bool read) {
  const auto deadline = Clock::now() + time;
  while (!closed_ && !out_.empty()) {
    const short ready = Wait(static_cast<short>(read ? POLLIN | POLLOUT : POLLOUT), deadline);
    if (ready == 0) return false;
    if (read && (ready & (POLLIN | POLLHUP | POLLERR)) != 0) ReadSome();
    if (!closed_ && (ready & (POLLOUT | POLLHUP | POLLERR)) != 0) WriteSome();
  }
  return !closed_;
}

bool Http2Client::SendData(std::uint32_t stream, std::string_view bytes, bool end_stream,
                           std::chrono::milliseconds time) {
  const auto deadline = Clock::now() + time;
  const auto left = [&] {
    return std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  };
  while (!bytes.empty()) {
    if (!Read(left(), [&] { return WindowOf(stream) > 0; })) return false;
    const auto room = static_cast<std::size_t>(WindowOf(stream));
    const std::string_view part = bytes.substr(0, std::min<std::size_t>(room, 1 << 20));
    bytes.remove_prefix(part.size());
    Data(stream, part, end_stream && bytes.empty());
    if (!Flush(left())) return false;
  }
  return true;
}

bool Http2Client::Read(std::chrono::milliseconds time, const std::function<bool()>& done) {
  const auto deadline = Clock::now() + time;
  const auto is_done = [&] { return done && done(); };
  while (!is_done() && !closed_) {
    const auto events = static_cast<short>(out_.empty() ? POLLIN : POLLIN | POLLOUT);
    const short ready = Wait(events, deadline);
    if (ready == 0) break;
    if ((ready & (POLLIN | POLLHUP | POLLERR)) != 0) ReadSome();
    if (!closed_ && (ready & POLLOUT) != 0) WriteSome();
  }
  return is_done();
}

void Http2Client::Close(bool reset) {
  if (socket_ < 0) return;
  if (reset) {
    const linger now{1, 0};
    setsockopt(socket_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  }
  tls_.reset();
  ::close(socket_);
  socket_ = -1;
  closed_ = true;
}

}  // namespace partiemc::attack
