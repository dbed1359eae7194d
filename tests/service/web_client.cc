#include "service/web_client.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

template <auto kFree>
struct Free {
  void operator()(auto* object) const { kFree(object); }
};
using Context = std::unique_ptr<SSL_CTX, Free<SSL_CTX_free>>;
using Bio = std::unique_ptr<BIO, Free<BIO_free_all>>;

Bio Reading(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Context MakeContext(const WebTls& tls) {
  Context context(SSL_CTX_new(TLS_client_method()));
  const Bio authority = Reading(tls.authority);
  X509* const trusted = PEM_read_bio_X509(authority.get(), nullptr, nullptr, nullptr);
  if (trusted != nullptr) X509_STORE_add_cert(SSL_CTX_get_cert_store(context.get()), trusted);
  X509_free(trusted);
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  if (!tls.own.key.empty()) {
    const Bio certificate = Reading(tls.own.certificate), key = Reading(tls.own.key);
    X509* const own = PEM_read_bio_X509(certificate.get(), nullptr, nullptr, nullptr);
    EVP_PKEY* const own_key = PEM_read_bio_PrivateKey(key.get(), nullptr, nullptr, nullptr);
    SSL_CTX_use_certificate(context.get(), own);
    SSL_CTX_use_PrivateKey(context.get(), own_key);
    X509_free(own);
    EVP_PKEY_free(own_key);
  }
  return context;
}

bool BindTo(int file, const char* from) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  return inet_pton(AF_INET, from, &address.sin_addr) == 1 &&
         bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
}

int ConnectTo(const Address& address, const char* from) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(address.host.c_str(), absl::StrCat(address.port).c_str(), &hints, &found) != 0) {
    return -1;
  }
  const int file = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool connected = file >= 0 && (from == nullptr || BindTo(file, from)) &&
                         connect(file, found->ai_addr, found->ai_addrlen) == 0;
  freeaddrinfo(found);
  if (connected || file < 0) return file;
  close(file);
  return -1;
}

std::string Lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

HttpReply ReceiveReply(WebPipe& pipe, bool has_body) {
  HttpReply reply;
  std::string head = pipe.ReceiveUntil("\r\n\r\n");
  if (head.size() < 12 || !head.starts_with("HTTP/1.1 ")) return reply;
  reply.status = static_cast<unsigned>(std::atoi(head.substr(9, 3).c_str()));
  for (std::size_t begin = head.find("\r\n") + 2; begin + 2 < head.size();) {
    const std::size_t end = head.find("\r\n", begin), colon = head.find(':', begin);
    if (colon < end) {
      reply.headers[Lower(head.substr(begin, colon - begin))] =
          head.substr(colon + 2, end - colon - 2);
    }
    begin = end + 2;
  }
  if (reply.status == 100) return ReceiveReply(pipe, has_body);
  const auto length = reply.headers.find("content-length");
  if (has_body && length != reply.headers.end()) {
    reply.body = pipe.Receive(std::strtoull(length->second.c_str(), nullptr, 10));
  }
  return reply;
}

}  // namespace

struct WebPipe::Connection {
  int file = -1;
  Context context;
  std::unique_ptr<SSL, Free<SSL_free>> tls;
  bool open = false;

  ~Connection() {
    tls.reset();
    if (file >= 0) close(file);
  }
  int Read(char* to, std::size_t bytes) {
    if (!open) return -1;
    if (tls != nullptr) return SSL_read(tls.get(), to, static_cast<int>(bytes));
    return static_cast<int>(recv(file, to, bytes, 0));
  }
};

WebPipe::WebPipe(const Address& address, const WebTls* tls, const char* from)
    : connection_(std::make_unique<Connection>()) {
  connection_->file = ConnectTo(address, from);
  connection_->open = connection_->file >= 0;
  if (tls == nullptr || !connection_->open) return;
  connection_->context = MakeContext(*tls);
  connection_->tls.reset(SSL_new(connection_->context.get()));
  SSL_set_fd(connection_->tls.get(), connection_->file);
  SSL_set1_host(connection_->tls.get(), "localhost");
  connection_->open = SSL_connect(connection_->tls.get()) == 1;
  ERR_clear_error();
}

WebPipe::~WebPipe() = default;

bool WebPipe::is_open() const { return connection_->open; }

bool WebPipe::Send(std::string_view bytes) {
  while (connection_->open && !bytes.empty()) {
    const auto sent =
        connection_->tls != nullptr
            ? SSL_write(connection_->tls.get(), bytes.data(),
                        static_cast<int>(std::min<std::size_t>(bytes.size(), 1 << 30)))
            : send(connection_->file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return connection_->open = false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return connection_->open;
}

std::string WebPipe::Receive(std::size_t bytes) {
  std::string text(bytes, '\0');
  std::size_t have = 0;
  while (have < bytes) {
    const int count = connection_->Read(text.data() + have, bytes - have);
    if (count <= 0) break;
    have += static_cast<std::size_t>(count);
  }
  text.resize(have);
  return text;
}

std::string WebPipe::ReceiveUntil(std::string_view end) {
  std::string text;
  char next = 0;
  while (text.size() < 65536 && !text.ends_with(end) && connection_->Read(&next, 1) == 1) {
    text += next;
  }
  return text;
}

std::string WebPipe::ReceiveAll() {
  std::string text;
  std::array<char, 4096> piece;
  for (int count = 0; (count = connection_->Read(piece.data(), piece.size())) > 0;) {
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

bool WebPipe::IsClosedWithin(int milliseconds) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(milliseconds);
  std::array<char, 4096> piece;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        until - std::chrono::steady_clock::now());
    pollfd waited{.fd = connection_->file, .events = POLLIN, .revents = 0};
    if (left.count() < 0 || poll(&waited, 1, static_cast<int>(left.count())) == 0) return false;
    if (recv(connection_->file, piece.data(), piece.size(), 0) <= 0) return true;
  }
}

void WebPipe::TakeLittle() {
  const int little = 4096;
  setsockopt(connection_->file, SOL_SOCKET, SO_RCVBUF, &little, sizeof(little));
}

void WebPipe::Close() { connection_ = std::make_unique<Connection>(); }

void WebPipe::Reset() {
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  setsockopt(connection_->file, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  Close();
}

HttpReply Ask(WebPipe& pipe, std::string_view method, std::string_view target,
              const WebHeaders& headers, std::string_view body) {
  std::string request = std::string(method) + " " + std::string(target) + " HTTP/1.1\r\n";
  if (Lower(headers).find("host:") == std::string::npos) request += "Host: localhost\r\n";
  request += headers;
  if (!body.empty() || method == "POST") {
    absl::StrAppend(&request, "Content-Length: ", body.size(), "\r\n");
  }
  pipe.Send(request + "\r\n" + std::string(body));
  return ReceiveReply(pipe, method != "HEAD");
}

HttpReply Ask(const Address& address, std::string_view method, std::string_view target,
              const WebHeaders& headers, std::string_view body, const WebTls* tls) {
  WebPipe pipe(address, tls);
  return Ask(pipe, method, target, headers, body);
}

HttpReply Post(const Address& address, std::string_view target, std::string_view body,
               const WebHeaders& headers, const WebTls* tls) {
  return Ask(address, "POST", target, "Content-Type: application/x-protobuf\r\n" + headers, body,
             tls);
}

WebEnd ParseStatus(std::string text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  WebEnd end;
  if (json.is_object()) {
    end.code = json.value("code", -1);
    end.reason = json.value("reason", "");
  }
  end.text = std::move(text);
  return end;
}

std::string ClientFrame(int opcode, std::string_view payload, bool last) {
  static constexpr std::array<char, 4> kMask = {0x12, 0x55, 0x33, 0x0f};
  std::string frame(1, static_cast<char>((last ? 0x80 : 0) | opcode));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80 | payload.size());
  } else {
    const int bytes = payload.size() < 65536 ? 2 : 8;
    frame += static_cast<char>(0x80 | (bytes == 2 ? 126 : 127));
    for (int i = bytes - 1; i >= 0; --i) frame += static_cast<char>(payload.size() >> 8 * i);
  }
  frame.append(kMask.data(), kMask.size());
  for (std::size_t i = 0; i < payload.size(); ++i) {
    frame += static_cast<char>(payload[i] ^ kMask[i % 4]);
  }
  return frame;
}

WebSocketClient::WebSocketClient(const Address& address, const std::string& path,
                                 const WebHeaders& headers, const std::string& protocols,
                                 const WebTls* tls, const char* from)
    : pipe_(address, tls, from) {
  handshake_ = Ask(pipe_, "GET", path,
                   "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                   "Sec-WebSocket-Protocol: " +
                       protocols + "\r\n" + headers);
}

WebSocketClient::Frame WebSocketClient::ReceiveFrame() {
  const std::string head = pipe_.Receive(2);
  if (head.size() < 2) return {};
  std::uint64_t bytes = static_cast<unsigned char>(head[1]) & 127;
  if (bytes > 125) {
    const std::string length = pipe_.Receive(bytes == 126 ? 2 : 8);
    bytes = 0;
    for (const unsigned char digit : length) bytes = bytes << 8 | digit;
  }
  Frame frame{.opcode = head[0] & 15, .payload = pipe_.Receive(bytes)};
  if (frame.payload.size() < bytes) return {};
  return frame;
}

std::optional<std::string> WebSocketClient::Receive() {
  while (!status_) {
    Frame frame = ReceiveFrame();
    if (frame.opcode == 2) return std::move(frame.payload);
    if (frame.opcode == 9) {
      ++pings_;
      if (answers_pings) pipe_.Send(ClientFrame(10, frame.payload));
      continue;
    }
    if (frame.opcode == 10) continue;
    if (frame.opcode != 1) return std::nullopt;
    status_ = std::move(frame.payload);
  }
  return std::nullopt;
}

WebEnd WebSocketClient::Finish() {
  while (Receive()) {
  }
  WebEnd end = ParseStatus(status_.value_or(""));
  const Frame close = ReceiveFrame();
  if (close.opcode == 8 && close.payload.size() >= 2) {
    end.close_code = static_cast<unsigned char>(close.payload[0]) * 256u +
                     static_cast<unsigned char>(close.payload[1]);
    pipe_.Send(ClientFrame(8, close.payload));
  }
  pipe_.Close();
  return end;
}

std::string Base64Url(std::string_view bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string text;
  unsigned bits = 0;
  int count = 0;
  for (const unsigned char byte : bytes) {
    bits = bits << 8 | byte;
    for (count += 8; count >= 6; count -= 6) text += kDigits[bits >> (count - 6) & 63];
  }
  if (count > 0) text += kDigits[bits << (6 - count) & 63];
  return text;
}

}  // namespace partiemc::server
