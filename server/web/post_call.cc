#include "server/web/post_call.h"

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/field.hpp>
#include <boost/beast/http/read.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "server/web/gathered_message.h"
#include "server/web/responses.h"

namespace partiemc::server {
namespace {

// Reads the body only when the call requests it, that is, after the caller was admitted.
class PostCall final : public WebChannel {
 public:
  PostCall(std::shared_ptr<WebConnection> connection, std::unique_ptr<HttpParser> parser,
           std::string allowed_origin, std::function<void()> next)
      : WebChannel(connection),
        parser_(std::move(parser)),
        allowed_origin_(std::move(allowed_origin)),
        next_(std::move(next)) {
    connection_->CloseNever();  // The call's state machine has its own time limits.
  }

 private:
  std::shared_ptr<PostCall> Self() {
    return std::static_pointer_cast<PostCall>(shared_from_this());
  }
  WebStream& stream() { return connection_->stream; }

  void Read() override {
    const auto length = parser_->content_length();
    if (length && *length > message_limit()) {
      return Break(WebRefusal::kTooLarge, TooLarge(*length));
    }
    parser_->body_limit(message_limit());  // Also limits chunked bodies, all chunks together.
    const auto expect = parser_->get()[boost::beast::http::field::expect];
    if (!boost::beast::iequals(expect, "100-continue")) return ReadMore();
    static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    stream().AsyncWriteAll(boost::asio::buffer(kContinue),
                           [self = Self()](error_code error, std::size_t) {
                             if (error) return self->OnDisconnect();
                             self->ReadMore();
                           });
  }

  void ReadMore() {
    if (!wanted()) return;  // The call has ended since.
    if (parser_->is_done()) return BodyCame();
    const auto left = parser_->content_length_remaining();
    const auto expected = left ? *left : message_limit() + 1 - gathered_.size();
    const auto room = gathered_.Room(expected);
    auto& body = parser_->get().body();
    body.data = room.data();
    body.size = room.size();
    body.more = true;
    boost::beast::http::async_read(
        stream(), connection_->buffer, *parser_,
        [self = Self(), bytes = room.size()](error_code error, std::size_t) {
          self->OnBody(error, bytes);
        });
  }

  void OnBody(error_code error, std::size_t room) {
    if (error == boost::beast::http::error::need_buffer) error = {};
    if (error == boost::beast::http::error::body_limit) {
      return Break(WebRefusal::kTooLarge, TooLarge(message_limit() + 1));
    }
    if (error) return OnDisconnect();
    gathered_.Filled(room - parser_->get().body().size);
    if (gathered_.size() > message_limit()) {
      return Break(WebRefusal::kTooLarge, TooLarge(gathered_.size()));
    }
    ReadMore();
  }

  void BodyCame() {
    Deliver(gathered_.Take());
    WatchForEnd();
  }

  // Reads from the connection while the response is computed, because only a read detects that the
  // client has disconnected.
  void WatchForEnd() {
    if (connection_->buffer.size() > 0) return;
    watching_ = true;
    stream().async_read_some(connection_->buffer.prepare(512),
                             [self = Self()](error_code error, std::size_t bytes) {
                               self->watching_ = false;
                               if (error) return self->OnEnd();
                               self->connection_->buffer.commit(bytes);
                               if (self->goes_on_) self->next_();
                             });
  }
  void OnEnd() {
    if (goes_on_) return connection_->Close();
    OnDisconnect();
  }

  void Write(const grpc::ByteBuffer& message) override {
    message.Dump(&slices_);
    WebResponse response = ResponseOfCall(message.Length());
    AddCallHeaders(response);
    head_ = response.Text();
    std::vector<boost::asio::const_buffer> buffers = {boost::asio::buffer(head_)};
    for (const grpc::Slice& slice : slices_) buffers.emplace_back(slice.begin(), slice.size());
    answered_ = true;
    stream().AsyncWriteAll(std::move(buffers), [self = Self()](error_code error, std::size_t) {
      self->slices_.clear();
      self->Written(!error);
      if (error) self->OnDisconnect();
    });
  }

  void SendEnd(const absl::Status& status) override {
    if (is_gone()) {
      OnEndSent();
      return connection_->Close();
    }
    if (answered_) return GoOn();
    WebResponse response = ResponseTo(status);
    if (is_broken() && absl::IsResourceExhausted(status)) response.status = 413;
    AddCallHeaders(response);
    head_ = response.Text();
    connection_->CloseAfter(kWebCloseTime);
    stream().AsyncWriteAll(boost::asio::buffer(head_),
                           [self = Self()](error_code error, std::size_t) {
                             if (error) self->OnDisconnect();
                             self->GoOn();
                           });
  }

  // Adds the headers of a call's response. If the request was not read completely, the connection
  // must close, because the rest of the request would be read as the next request.
  void AddCallHeaders(WebResponse& response) {
    response.close = !parser_->is_done() || !parser_->keep_alive();
    if (!allowed_origin_.empty()) AllowOrigin(allowed_origin_, response);
  }

  void GoOn() {
    const bool keeps = !is_gone() && parser_->is_done() && parser_->keep_alive();
    OnEndSent();
    if (!keeps) return connection_->CloseGently();
    connection_->slot.SetState(ConnectionSlots::State::kNoCall);
    goes_on_ = true;
    connection_->CloseIdleAfter(kWebHeaderTime);
    if (!watching_) next_();
  }

  const std::unique_ptr<HttpParser> parser_;
  const std::string allowed_origin_;
  const std::function<void()> next_;
  GatheredMessage gathered_;
  std::string head_;
  std::vector<grpc::Slice> slices_;  // Slices of the response.
  bool answered_ = false, watching_ = false, goes_on_ = false;
};

}  // namespace

std::shared_ptr<WebChannel> MakePostCall(std::shared_ptr<WebConnection> connection,
                                         std::unique_ptr<HttpParser> parser,
                                         std::string allowed_origin, std::function<void()> next) {
  return std::make_shared<PostCall>(std::move(connection), std::move(parser),
                                    std::move(allowed_origin), std::move(next));
}

}  // namespace partiemc::server
