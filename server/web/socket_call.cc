#include "server/web/socket_call.h"

#include <sys/ioctl.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket/error.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "partiemc/status.h"
#include "server/base/call_errors.h"
#include "server/stream/stream_state_machine.h"
#include "server/web/gathered_message.h"
#include "server/web/responses.h"
#include "server/web/signs_of_life.h"
#include "server/web/status_text.h"

namespace partiemc::server {
namespace {

class SocketCall final : public WebChannel {
 public:
  SocketCall(std::shared_ptr<WebConnection> connection, std::unique_ptr<HttpParser> parser,
             bool from_page)
      : WebChannel(connection),
        socket_(connection->stream),
        parser_(std::move(parser)),
        from_page_(from_page),
        clock_(connection->executor()) {
    connection_->CloseAfter(kWebHeaderTime);
  }

 private:
  using Now = std::chrono::steady_clock;
  enum Phase { kHttp, kUpgrading, kOpen };

  // Maximum bytes that are read ahead while the call requests no message. Reading ahead detects a
  // disconnect and answers pings.
  static constexpr std::size_t kReadAhead = 64 << 10;
  static constexpr std::size_t kLongestText = 3;  // The text message "end".

  std::shared_ptr<SocketCall> Self() {
    return std::static_pointer_cast<SocketCall>(shared_from_this());
  }

  void Read() override {
    if (phase_ == kHttp) Upgrade();
    if (phase_ == kOpen) Pump();
  }

  void Upgrade() {
    namespace websocket = boost::beast::websocket;
    phase_ = kUpgrading;
    socket_.set_option(
        websocket::stream_base::timeout{kWebHeaderTime, websocket::stream_base::none(), false});
    socket_.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
      response.set(boost::beast::http::field::server, "partiemc");
      response.set(boost::beast::http::field::sec_websocket_protocol,
                   boost::beast::string_view(kWebProtocol.data(), kWebProtocol.size()));
    }));
    socket_.auto_fragment(false);
    socket_.read_message_max(0);  // No limit: OnSome refuses with a reason.
    socket_.control_callback([this](websocket::frame_type kind, auto) {
      signs_.OnSign(Now::now());
      if (kind == websocket::frame_type::close) OnClientClose();
    });
    socket_.async_accept(parser_->get(),
                         [self = Self()](error_code error) { self->OnUpgraded(error); });
  }

  void OnUpgraded(error_code error) {
    parser_.reset();
    phase_ = kOpen;
    if (error) {
      OnDisconnect();
      if (is_finished()) EndWithoutSending();
      return;
    }
    connection_->CloseNever();
    if (is_finished()) return SendStatus();
    signs_.OnSign(Now::now());
    CheckLiveness();
    Pump();
  }

  // The client has closed the WebSocket. If the call has not finished, closes this side too, and
  // cancels the call.
  void OnClientClose() {
    if (is_finished()) return;
    client_closed_ = true;
    connection_->CloseAfter(kWebCloseTime);
    CancelCall();
  }

  // Delivers a complete message that was read ahead, if the call waits for one. After the client's
  // "end", reports the end of the requests instead. Then starts a read. Starts none while a
  // complete message waits, or while kReadAhead bytes were read ahead and the call waits for no
  // message.
  void Pump() {
    if (reading_ || is_gone() || is_finished() || is_broken()) return;
    if (half_closed_) {
      ReadEnded();
    } else if (complete_) {
      if (!wanted()) return;
      complete_ = false;
      Deliver(gathered_.Take());
    }
    if (!wanted() && gathered_.size() >= kReadAhead) return;
    reading_ = true;
    const auto room = gathered_.Room(socket_.read_size_hint(kFirstGuess));
    socket_.async_read_some(boost::asio::buffer(room.data(), room.size()),
                            [self = Self()](error_code error, std::size_t bytes) {
                              self->reading_ = false;
                              self->OnSome(error, bytes);
                            });
  }

  void OnSome(error_code error, std::size_t bytes) {
    if (client_closed_) return connection_->Close();
    if (is_finished()) return;
    if (error) {
      if (error != boost::beast::websocket::error::closed && IsProtocolError(error)) {
        connection_->context.refusals.Count(WebRefusal::kBadMessage);
      }
      return OnDisconnect();
    }
    signs_.OnSign(Now::now());
    gathered_.Filled(bytes);
    complete_ = socket_.is_message_done();
    if (half_closed_) return Misspoken("a message after `end`");
    if (socket_.got_text()) return TakeText();
    const std::uint64_t announced = gathered_.size() + (complete_ ? 0 : socket_.read_size_hint(1));
    if (announced > message_limit()) return Break(WebRefusal::kTooLarge, TooLarge(announced));
    Pump();
  }

  void TakeText() {
    if (gathered_.size() > kLongestText) return Misspoken("a text message");
    if (complete_) {
      std::vector<grpc::Slice> slices;
      const grpc::ByteBuffer message = gathered_.Take();
      message.Dump(&slices);
      std::string text;
      for (const auto& slice : slices) text.append(slice.begin(), slice.end());
      if (text != "end") return Misspoken("a text message");
      complete_ = false;
      half_closed_ = true;
    }
    Pump();
  }

  void Misspoken(std::string value) {
    Break(WebRefusal::kBadMessage,
          ViolationError(absl::StatusCode::kInvalidArgument,
                         {std::string(kReasonMalformed), "message", std::move(value),
                          "must be binary, or at last the text `end`"}));
  }

  static bool IsProtocolError(error_code error) {
    return error.category() ==
           make_error_code(boost::beast::websocket::error::bad_opcode).category();
  }

  void Write(const grpc::ByteBuffer& message) override {
    if (client_closed_) return Written(false);
    message.Dump(&slices_);
    std::vector<boost::asio::const_buffer> buffers;
    for (const grpc::Slice& slice : slices_) buffers.emplace_back(slice.begin(), slice.size());
    signs_.WriteBegan(Now::now());
    socket_.binary(true);
    SendMessage(std::move(buffers), &SocketCall::OnWritten);
  }

  void OnWritten(error_code error) {
    slices_.clear();
    Written(!error);
    if (error) OnDisconnect();
  }

  // Both kinds of messages are sent here, because async_write takes long to compile.
  void SendMessage(std::vector<boost::asio::const_buffer> buffers,
                   void (SocketCall::*sent)(error_code)) {
    socket_.async_write(buffers, [self = Self(), sent](error_code error, std::size_t) {
      (self.get()->*sent)(error);
    });
  }

  // Checks for signs of life in intervals of SignsOfLife::interval.
  void CheckLiveness() {
    clock_.expires_after(signs_.interval());
    clock_.async_wait([weak = weak_from_this(), this](error_code error) {
      const auto self = weak.lock();
      if (error || self == nullptr || is_gone() || is_finished()) return;
      int unsent = 0;
      ioctl(connection_->stream.next_layer().native_handle(), TIOCOUTQ, &unsent);
      const auto next = signs_.Check(Now::now(), reading_, is_writing(), unsent);
      if (next == SignsOfLife::Next::kGiveUp) {
        connection_->context.refusals.Count(WebRefusal::kTimeout);
        return connection_->Close();
      }
      if (next == SignsOfLife::Next::kPing) {
        socket_.async_ping({}, [self](error_code) {});
      }
      CheckLiveness();
    });
  }

  void SendEnd(const absl::Status& status) override {
    last_status_ = status;
    if (is_gone()) return EndWithoutSending();
    if (client_closed_) return OnEndSent();
    if (phase_ == kOpen) return SendStatus();
    if (phase_ == kUpgrading) return;  // OnUpgraded continues.
    if (from_page_) return Upgrade();
    WebResponse response = ResponseTo(status);
    response.close = true;
    text_ = response.Text();
    connection_->stream.AsyncWriteAll(boost::asio::buffer(text_),
                                      [self = Self()](error_code, std::size_t) {
                                        self->OnEndSent();
                                        self->connection_->CloseGently();
                                      });
  }

  void SendStatus() {
    connection_->CloseAfter(kWebCloseTime);
    text_ = StatusJson(last_status_);
    socket_.text(true);
    SendMessage({boost::asio::buffer(text_)}, &SocketCall::OnStatusSent);
  }

  void OnStatusSent(error_code error) {
    if (error) return EndWithoutSending();
    OnEndSent();
    CloseSocket();
  }

  void CloseSocket() {
    const boost::beast::websocket::close_reason reason(
        static_cast<boost::beast::websocket::close_code>(CloseCodeOf(last_status_)),
        CloseReasonOf(last_status_));
    socket_.async_close(reason, [self = Self()](error_code) { self->connection_->Close(); });
  }

  void EndWithoutSending() {
    OnEndSent();
    connection_->Close();
  }

  // Size of the first buffer for a message, whose length is unknown.
  static constexpr std::size_t kFirstGuess = 4096;

  boost::beast::websocket::stream<WebStream&, false> socket_;
  std::unique_ptr<HttpParser> parser_;  // The request that began the WebSocket.
  const bool from_page_;
  boost::asio::steady_timer clock_;
  SignsOfLife signs_{connection_->context.pings, connection_->context.limits.unary.answer,
                     Now::now()};
  Phase phase_ = kHttp;
  GatheredMessage gathered_;
  bool reading_ = false, complete_ = false, half_closed_ = false, client_closed_ = false;
  std::vector<grpc::Slice> slices_;  // Slices of the message being written.
  std::string text_;
  absl::Status last_status_;
};

}  // namespace

std::shared_ptr<WebChannel> MakeSocketCall(std::shared_ptr<WebConnection> connection,
                                           std::unique_ptr<HttpParser> parser, bool from_page) {
  return std::make_shared<SocketCall>(std::move(connection), std::move(parser), from_page);
}

}  // namespace partiemc::server
