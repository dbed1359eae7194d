// A call that comes through the gateway, as far as it does not matter how.
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

/// Brings what a state machine asks for, from whichever thread, to the connection's strand, and
/// keeps the promises of a channel: each read and write is answered once, OnCancel comes once at
/// most, OnDone last. Holds itself until then. Held by shared_ptr only.
class WebChannel : public CallChannel, public std::enable_shared_from_this<WebChannel> {
 public:
  explicit WebChannel(std::shared_ptr<WebConnection> connection)
      : connection_(std::move(connection)) {}

  /// On the strand. What the call asks for comes after this has returned.
  void Begin(Methods::Method method, CallOrigin origin);

  void StartRead(grpc::ByteBuffer* message) final;
  void StartWrite(const grpc::ByteBuffer* message) final;
  void Cancel() final;
  void Finish(const absl::Status& status) final;
  bool IsCancelled() const final { return cancelled_; }
  std::string peer() const final { return connection_->peer; }

 protected:
  // Of the transport, on the strand:

  /// Brings the next message by Deliver, some time, or none by ReadEnded.
  virtual void Read() = 0;
  /// Ends in Written.
  virtual void Write(const grpc::ByteBuffer& message) = 0;
  /// Tells how the call ended; ends in Over. The connection may be gone.
  virtual void Tell(const absl::Status& status) = 0;

  // For the transport, on the strand:

  bool wanted() const { return wanted_ != nullptr; }
  void Deliver(grpc::ByteBuffer message);
  /// No message comes any more: a half-close, or after Gone.
  void ReadEnded();
  void Written(bool ok);
  /// Nobody is there any more; or nobody waits any more, and what is told may still arrive.
  void Gone();
  void TellCancelled();
  /// The client has done what it must not: its call is cancelled, and this is what it is told.
  void Break(WebRefusal refusal, absl::Status status);
  /// The end was told, or cannot be.
  void Over();

  bool is_gone() const { return gone_; }
  bool is_broken() const { return told_instead_.has_value(); }
  bool is_finished() const { return finished_; }
  bool is_writing() const { return writing_; }
  /// Of one message of this method.
  std::uint64_t message_limit() const { return message_limit_; }
  absl::Status TooLarge(std::uint64_t bytes) const;

  const std::shared_ptr<WebConnection> connection_;

 private:
  template <typename Action>
  void Post(Action action) {
    boost::asio::post(connection_->executor(),
                      [self = shared_from_this(), action = std::move(action)] { action(); });
  }

  std::shared_ptr<WebChannel> self_;  // Until the call is over.
  std::unique_ptr<ByteCall> call_;
  grpc::ByteBuffer* wanted_ = nullptr;  // Of the read that goes on.
  std::atomic<bool> cancelled_ = false;
  bool admitted_ = false, writing_ = false, gone_ = false, finished_ = false, told_cancel_ = false;
  std::uint64_t message_limit_ = 0;
  std::optional<absl::Status> told_instead_;
};

}  // namespace partiemc::server
