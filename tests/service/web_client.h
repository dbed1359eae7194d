// A gateway client with its own HTTP and WebSocket code, so that it can also send malformed data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/address.h"
#include "support/certificates.h"

namespace partiemc::server {

/// TLS settings of a client of the gateway.
struct WebTls {
  std::string authority;       ///< PEM.
  IssuedCertificate own = {};  ///< Optional client certificate.
};

/// A blocking connection, with or without TLS. Receives nothing after an error.
class WebPipe {
 public:
  /// `from`: the local IPv4 address to connect from; or null.
  explicit WebPipe(const Address& address, const WebTls* tls = nullptr, const char* from = nullptr);
  ~WebPipe();
  WebPipe(const WebPipe&) = delete;
  WebPipe& operator=(const WebPipe&) = delete;

  /// True if connected, including TLS.
  bool is_open() const;
  bool Send(std::string_view bytes);
  /// Receives `bytes` bytes, or fewer if the connection ends.
  std::string Receive(std::size_t bytes);
  /// Receives up to and including `end`, at most 64 KiB.
  std::string ReceiveUntil(std::string_view end);
  /// Receives until the other side closes.
  std::string ReceiveAll();
  /// True if the other side closes within `milliseconds`; drops bytes before that.
  bool IsClosedWithin(int milliseconds);
  /// Minimises the receive buffer, so that the other side soon has to wait. Call before receiving.
  void TakeLittle();
  void Close();
  /// Closes without a closing handshake, like a killed program.
  void Reset();

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

/// One header per line: "Origin: http://localhost\r
/// ".
using WebHeaders = std::string;

struct HttpReply {
  unsigned status = 0;                              ///< 0: no response.
  std::map<std::string, std::string> headers = {};  ///< By lower-case name.
  std::string body = {};
};

/// Sends a request and receives its reply; the connection stays open if the server allows it.
HttpReply Ask(WebPipe& pipe, std::string_view method, std::string_view target,
              const WebHeaders& headers = {}, std::string_view body = {});
/// Same as above on a new connection.
HttpReply Ask(const Address& address, std::string_view method, std::string_view target,
              const WebHeaders& headers = {}, std::string_view body = {},
              const WebTls* tls = nullptr);
/// A call by POST.
HttpReply Post(const Address& address, std::string_view target, std::string_view body,
               const WebHeaders& headers = {}, const WebTls* tls = nullptr);

/// The end of a call.
struct WebEnd {
  int code = -1;            ///< Code in the status text; -1: none.
  std::string reason;       ///< Reason of its Violation.
  std::string text;         ///< The whole status text.
  unsigned close_code = 0;  ///< 0: the connection was cut.
};
WebEnd ParseStatus(std::string text);

/// A masked client frame. `opcode`: 0 continuation, 1 text, 2 binary, 8 close, 9 ping.
std::string ClientFrame(int opcode, std::string_view payload, bool last = true);

/// One call over a WebSocket, driven step by step.
class WebSocketClient {
 public:
  WebSocketClient(const Address& address, const std::string& path, const WebHeaders& headers = {},
                  const std::string& protocols = "partiemc.v1", const WebTls* tls = nullptr,
                  const char* from = nullptr);

  /// The response to the handshake: 101 if it succeeded.
  const HttpReply& handshake() const { return handshake_; }
  WebPipe& pipe() { return pipe_; }

  bool Send(std::string_view message) { return pipe_.Send(ClientFrame(2, message)); }
  template <typename Message>
  bool SendMessage(const Message& message) {
    return Send(message.SerializeAsString());
  }
  void HalfClose() { pipe_.Send(ClientFrame(1, "end")); }
  /// The next binary message; empty after the status. Answers pings.
  std::optional<std::string> Receive();
  /// Its parsed form; an empty message at the end.
  template <typename Message>
  Message Receive() {
    Message message;
    if (const auto bytes = Receive()) message.ParseFromString(*bytes);
    return message;
  }
  /// Drops the rest, answers the close frame, closes and returns the end.
  WebEnd Finish();

  std::size_t pings() const { return pings_; }
  bool answers_pings = true;

 private:
  struct Frame {
    int opcode = -1;  // -1: the connection is closed.
    std::string payload;
  };
  Frame ReceiveFrame();

  WebPipe pipe_;
  HttpReply handshake_;
  std::size_t pings_ = 0;
  std::optional<std::string> status_;
};

/// base64url without padding.
std::string Base64Url(std::string_view bytes);

}  // namespace partiemc::server
