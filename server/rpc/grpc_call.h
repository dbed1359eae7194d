// gRPC as a CallChannel.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "server/calls/admission.h"
#include "server/calls/byte_call.h"
#include "server/calls/call_channel.h"
#include "server/connections/connection_table.h"

namespace partiemc::server {

/// Deletes itself and its call in OnDone, gRPC's last call.
class GrpcCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                       private CallChannel {
 public:
  using Make = std::function<std::unique_ptr<ByteCall>(CallChannel&, const CallOrigin&)>;

  /// Reports the call and its messages to the ledger of its connection, found in `connections`.
  GrpcCall(grpc::CallbackServerContext& context, const ConnectionTable& connections, CallKind kind,
           const Make& make);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override { call_->OnWriteDone(ok); }
  void OnCancel() override { call_->OnCancel(); }
  void OnDone() override;

 private:
  using Reactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

  void StartRead(grpc::ByteBuffer* message) override;
  void StartWrite(const grpc::ByteBuffer* message) override { Reactor::StartWrite(message); }
  void Cancel() override { context_.TryCancel(); }
  void Finish(const absl::Status& status) override;
  bool IsCancelled() const override { return context_.IsCancelled(); }
  std::string peer() const override { return context_.peer(); }

  grpc::CallbackServerContext& context_;
  CallTally tally_;
  grpc::ByteBuffer* message_ = nullptr;  // The read in progress.
  // gRPC calls nothing before the constructor has returned.
  std::unique_ptr<ByteCall> call_;
};

/// The origin of a call of gRPC. Several headers `authorization` count as none, because the choice
/// would depend on their order.
CallOrigin OriginOf(const grpc::ServerContextBase& context);

}  // namespace partiemc::server
