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

/// The CallChannel of a gRPC call. Owns its ByteCall. Deletes itself in OnDone, which is the last
/// call that gRPC makes.
class GrpcCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                       private CallChannel {
 public:
  using Make = std::function<std::unique_ptr<ByteCall>(CallChannel&, const CallOrigin&)>;

  /// Looks up the connection of the call in `connections`, and reports the call and its messages to
  /// the ledger of this connection.
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
  // Created last in the constructor; gRPC calls no method before the constructor has returned.
  std::unique_ptr<ByteCall> call_;
};

/// Returns the origin of a gRPC call. If the header `authorization` occurs several times, it counts
/// as missing, because a choice would depend on the order of the headers.
CallOrigin OriginOf(const grpc::ServerContextBase& context);

}  // namespace partiemc::server
