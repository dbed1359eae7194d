// The common part of calls through the gateway, for all its transports (POST and WebSocket).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "server/calls/byte_call.h"
#include "server/calls/call_channel.h"
#include "server/calls/methods.h"
#include "server/web/connection.h"

namespace partiemc::server {

/// Runs the requests of a call's state machine on the connection's strand. Keeps the contract of
/// CallChannel: each read and each write completes once, OnCancel is called at most once, and
/// OnDone is called last. Keeps itself alive until then. Held by shared_ptr.
class WebChannel : public CallChannel, public std::enable_shared_from_this<WebChannel> {
 public:
  explicit WebChannel(std::shared_ptr<WebConnection> connection)
      : connection_(std::move(connection)) {}

  /// Begins the call. Called on the strand; reads and writes that the call starts run after Begin
  /// has returned.
  void Begin(Methods::Method method, CallOrigin origin);

  void StartRead(grpc::ByteBuffer* message) final;
  void StartWrite(const grpc::ByteBuffer* message) final;
  void Cancel() final;
  void Finish(const absl::Status& status) final;
  bool IsCancelled() const final { return cancelled_; }
  std::string peer() const final { return connection_->peer; }

 protected:
  // Implemented by the transport, on the strand:

  /// Starts to read the next message. Completes by Deliver, or by ReadEnded if no message follows.
  virtual void Read() = 0;
  /// Starts to send the message. Completes by Written.
  virtual void Write(const grpc::ByteBuffer& message) = 0;
  /// Sends the end of the call; completes by OnEndSent. The connection may already be closed.
  virtual void SendEnd(const absl::Status& status) = 0;

  // For the transport, on the strand:

  bool wanted() const { return wanted_ != nullptr; }
  void Deliver(grpc::ByteBuffer message);
  /// The client sends no further message, because it has half-closed or disconnected.
  void ReadEnded();
  void Written(bool ok);
  /// The client has disconnected: cancels the call, and sends nothing more.
  void OnDisconnect();
  /// Cancels the call. Its status is still sent, unless the client has disconnected.
  void CancelCall();
  /// The client has broken the protocol: cancels the call and sends `status`.
  void Break(WebRefusal refusal, absl::Status status);
  /// The end was sent, or cannot be sent. Deletes the call.
  void OnEndSent();

  bool is_gone() const { return gone_; }
  bool is_broken() const { return break_status_.has_value(); }
  bool is_finished() const { return finished_; }
  bool is_writing() const { return writing_; }
  /// Maximum size of one received message, in bytes: the limit of frames for methods that carry
  /// frames, else a value above the limits of all other methods. Sent messages have no limit here.
  std::uint64_t message_limit() const { return message_limit_; }
  absl::Status TooLarge(std::uint64_t bytes) const;

  const std::shared_ptr<WebConnection> connection_;

 private:
  template <typename Action>
  void Post(Action action) {
    boost::asio::post(connection_->executor(),
                      [self = shared_from_this(), action = std::move(action)] { action(); });
  }

  std::shared_ptr<WebChannel> self_;  // Keeps this object alive until the end of the call.
  std::unique_ptr<ByteCall> call_;
  grpc::ByteBuffer* wanted_ = nullptr;  // Destination of the pending read.
  std::atomic<bool> cancelled_ = false;
  bool admitted_ = false, writing_ = false, gone_ = false, finished_ = false,
       cancel_reported_ = false;
  std::uint64_t message_limit_ = 0;
  std::optional<absl::Status> break_status_;
};

}  // namespace partiemc::server
