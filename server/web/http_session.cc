#include "server/web/http_session.h"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/read.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/web/connection.h"
#include "server/web/http_request.h"
#include "server/web/post_call.h"
#include "server/web/responses.h"
#include "server/web/socket_call.h"

namespace partiemc::server {
namespace {

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  explicit HttpSession(std::shared_ptr<WebConnection> connection)
      : connection_(std::move(connection)) {}

  /// Reads a request. Sends the response, or passes the connection to the call that the request
  /// begins.
  void ReadRequest() {
    allowed_origin_.clear();
    parser_ = std::make_unique<HttpParser>();
    SetUp(*parser_);
    connection_->CloseAfter(kWebHeaderTime);
    boost::beast::http::async_read_header(
        connection_->stream, connection_->buffer, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->OnHeader(error); });
  }

 private:
  // Waits for the first bytes of another request.
  void AwaitRequest() {
    if (connection_->buffer.size() > 0) return ReadRequest();
    parser_.reset();
    connection_->CloseIdleAfter(kWebHeaderTime);
    connection_->stream.async_read_some(
        connection_->buffer.prepare(kFirstBytes),
        [self = shared_from_this()](error_code error, std::size_t bytes) {
          if (error) return self->connection_->Close();
          self->connection_->buffer.commit(bytes);
          self->ReadRequest();
        });
  }

  static constexpr std::size_t kFirstBytes = 512;
  static constexpr std::size_t kFilePiece = 32 << 10;

  void OnHeader(error_code error) {
    namespace http = boost::beast::http;
    if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      return Refuse({WebRefusal::kTooLarge, 431, "header", "longer",
                     "the request must have a header of at most 16 KiB"});
    }
    if (error.category() == make_error_code(http::error::bad_method).category() &&
        error != http::error::end_of_stream && error != http::error::partial_message) {
      return Refuse({WebRefusal::kMalformed, 400, "request", error.message(),
                     "the request must be HTTP/1.1"});
    }
    if (error) return connection_->Close();
    WebAnswer answer = Understand(ViewOf(*parser_), connection_->context.rules);
    if (connection_->slot.reserved()) {
      closes_ = true;
      if (!std::holds_alternative<WebHealth>(answer.what)) return Refuse(FullServer());
    }
    allowed_origin_ = std::move(answer.allowed_origin);
    std::visit([this](auto& what) { Do(what); }, answer.what);
  }

  static WebRefused FullServer() {
    return {WebRefusal::kFull, 503, "connection", "reserved for health checks",
            "the client must try again later: all connections of the server, or of this address, "
            "have calls"};
  }

  void Refuse(WebRefused refused) {
    parser_->get().keep_alive(false);
    closes_ = true;
    Do(refused);
  }

  void Do(const WebRefused& refused) {
    closes_ = closes_ || refused.http_status == 400;  // The request's end is unknown.
    connection_->context.Refuse(refused.refusal, connection_->peer, ToStatus(refused));
    Send(ResponseTo(refused));
  }
  void Do(const WebHealth& health) { Send(ResponseTo(health, connection_->context.draining())); }
  void Do(const WebPreflight&) { Send(ResponseToPreflight()); }

  void Do(const WebFile& asked) {
    const PageFiles& files = connection_->context.files;
    auto file = files.Find(asked);
    if (!file) return Send(ResponseWithoutFile(asked, files.HasPage()));
    WebResponse response =
        ResponseOf(*file, asked, ViewOf(*parser_).if_none_match, connection_->context.page_policy);
    if (response.head_only || file->bytes == 0) return Send(std::move(response));
    file_.emplace(*std::move(file));
    left_ = file_->bytes;
    Send(std::move(response));
  }

  void Do(WebCall& call) {
    CallOrigin origin{.peer = connection_->peer, .authorization = std::move(call.authorization)};
    switch (call.method) {
      case WebMethod::kWatch:
        return BeginSocket(Methods::Method::kWatchStream, std::move(origin), call.from_page);
      case WebMethod::kReconstruct:
        return BeginSocket(Methods::Method::kReconstruct, std::move(origin), call.from_page);
      case WebMethod::kInfo:
        return BeginPost(Methods::Method::kGetServerInfo, std::move(origin));
      case WebMethod::kStreams:
        return BeginPost(Methods::Method::kListStreams, std::move(origin));
      case WebMethod::kFrame:
        return BeginPost(Methods::Method::kReconstructFrame, std::move(origin));
    }
  }

  void BeginSocket(Methods::Method method, CallOrigin origin, bool from_page) {
    if (connection_->buffer.size() > 0) {
      return Refuse({WebRefusal::kMalformed, 400, "handshake", "followed by other bytes",
                     "the client must wait for the answer to its handshake"});
    }
    MakeSocketCall(connection_, std::move(parser_), from_page)->Begin(method, std::move(origin));
  }

  void BeginPost(Methods::Method method, CallOrigin origin) {
    MakePostCall(connection_, std::move(parser_), std::move(allowed_origin_),
                 [self = shared_from_this()] { self->AwaitRequest(); })
        ->Begin(method, std::move(origin));
  }

  // Sends a response. The connection stays open for another request only if this request was read
  // completely.
  void Send(WebResponse response) {
    if (parser_->is_header_done()) {  // Otherwise the request was refused and has no fields.
      const auto request = ViewOf(*parser_);
      closes_ = closes_ || !parser_->keep_alive() || request.has_body;
      if (request.method == "HEAD") response.head_only = true;
    }
    response.close = closes_;
    if (!allowed_origin_.empty()) AllowOrigin(allowed_origin_, response);
    text_ = response.Text();
    connection_->CloseAfter(kWebResponseTime);
    Write(boost::asio::buffer(text_));
  }

  void Write(boost::asio::const_buffer bytes) {
    connection_->stream.AsyncWriteAll(bytes,
                                      [self = shared_from_this()](error_code error, std::size_t) {
                                        if (error) return self->connection_->Close();
                                        self->WriteMore();
                                      });
  }

  void WriteMore() {
    if (!file_) {
      if (closes_) return connection_->CloseGently();
      return AwaitRequest();
    }
    piece_.resize(kFilePiece);
    const auto count = read(file_->file.descriptor(), piece_.data(),
                            std::min<std::uint64_t>(left_, piece_.size()));
    // A read error, or the file has become shorter than announced.
    if (count <= 0) return connection_->Close();
    left_ -= static_cast<std::uint64_t>(count);
    connection_->CloseAfter(kWebResponseTime);
    if (left_ == 0) file_.reset();
    Write(boost::asio::buffer(piece_.data(), static_cast<std::size_t>(count)));
  }

  const std::shared_ptr<WebConnection> connection_;
  std::unique_ptr<HttpParser> parser_;
  std::string allowed_origin_, text_;
  bool closes_ = false;
  std::optional<PageFile> file_;  // The file being sent.
  std::uint64_t left_ = 0;
  std::vector<char> piece_;
};

}  // namespace

void ServeHttp(std::shared_ptr<WebConnection> connection) {
  std::make_shared<HttpSession>(std::move(connection))->ReadRequest();
}

}  // namespace partiemc::server
