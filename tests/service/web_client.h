// A client of the gateway that speaks HTTP and WebSocket by itself, so that it can also say what
// no library says.
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

/// What a client trusts and shows where the gateway speaks TLS.
struct WebTls {
  std::string authority;       ///< PEM.
  IssuedCertificate own = {};  ///< Or none.
};

/// A connection, in the clear or with TLS. Blocks; nothing comes any more once it is broken.
class WebPipe {
 public:
  /// `from`: the IPv4 address that it comes from, one of this machine's; or null.
  explicit WebPipe(const Address& address, const WebTls* tls = nullptr, const char* from = nullptr);
  ~WebPipe();
  WebPipe(const WebPipe&) = delete;
  WebPipe& operator=(const WebPipe&) = delete;

  /// Whether it came about, TLS included.
  bool is_open() const;
  bool Send(std::string_view bytes);
  /// So many bytes, or fewer where no more come.
  std::string Receive(std::size_t bytes);
  /// Up to and with `end`, at most 64 KiB.
  std::string ReceiveUntil(std::string_view end);
  /// Until the other side closes.
  std::string ReceiveAll();
  /// Whether the other side closes within `milliseconds`; what comes before that is dropped.
  bool IsClosedWithin(int milliseconds);
  /// Takes as little as the system lets it before the other side has to wait. Before anything
  /// comes.
  void TakeLittle();
  void Close();
  /// Without a word to the other side, as when a program dies.
  void Reset();

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

/// One header a line: "Origin: http://localhost\r\n".
using WebHeaders = std::string;

struct HttpReply {
  unsigned status = 0;                              ///< 0: none came.
  std::map<std::string, std::string> headers = {};  ///< By their names in lower case.
  std::string body = {};
};

/// A request and its reply; the connection stays open where the server says so.
HttpReply Ask(WebPipe& pipe, std::string_view method, std::string_view target,
              const WebHeaders& headers = {}, std::string_view body = {});
/// The same in a connection of its own.
HttpReply Ask(const Address& address, std::string_view method, std::string_view target,
              const WebHeaders& headers = {}, std::string_view body = {},
              const WebTls* tls = nullptr);
/// A call by POST.
HttpReply Post(const Address& address, std::string_view target, std::string_view body,
               const WebHeaders& headers = {}, const WebTls* tls = nullptr);

/// How a call ended.
struct WebEnd {
  int code = -1;            ///< Of the status text; -1: none came.
  std::string reason;       ///< Of its Violation.
  std::string text;         ///< All of it.
  unsigned close_code = 0;  ///< 0: the connection was cut.
};
WebEnd ParseStatus(std::string text);

/// A frame as a client sends it: masked. `opcode`: 0 goes on, 1 text, 2 binary, 8 close, 9 ping.
std::string ClientFrame(int opcode, std::string_view payload, bool last = true);

/// One call over a WebSocket, driven step by step.
class WebSocketClient {
 public:
  WebSocketClient(const Address& address, const std::string& path, const WebHeaders& headers = {},
                  const std::string& protocols = "partiemc.v1", const WebTls* tls = nullptr,
                  const char* from = nullptr);

  /// Of the handshake: 101 where it came about.
  const HttpReply& handshake() const { return handshake_; }
  WebPipe& pipe() { return pipe_; }

  bool Send(std::string_view message) { return pipe_.Send(ClientFrame(2, message)); }
  template <typename Message>
  bool SendMessage(const Message& message) {
    return Send(message.SerializeAsString());
  }
  void HalfClose() { pipe_.Send(ClientFrame(1, "end")); }
  /// The next binary message; nothing once the status has come. Pings are answered.
  std::optional<std::string> Receive();
  /// Its parsed form; one without a case where nothing comes.
  template <typename Message>
  Message Receive() {
    Message message;
    if (const auto bytes = Receive()) message.ParseFromString(*bytes);
    return message;
  }
  /// Drops what is left, answers the close frame, closes and gives what was said at the end.
  WebEnd Finish();

  std::size_t pings() const { return pings_; }
  bool answers_pings = true;

 private:
  struct Frame {
    int opcode = -1;  // -1: the connection is gone.
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
