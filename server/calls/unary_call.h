// The call of a unary method (one request, one response), over any channel.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/calls/byte_call.h"
#include "server/calls/server_context.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

class UnaryCall final : public ByteCall, private UnaryTransport {
 public:
  /// Computes the response to a request, unless `cancelled`. May clear the request. `worker` is
  /// null except for UnaryKind::kFrame.
  using Method = std::function<absl::StatusOr<grpc::ByteBuffer>(
      grpc::ByteBuffer& request, Worker* worker, const std::atomic<bool>& cancelled)>;

  /// A compute thread runs `method` for UnaryKind::kFrame, a thread of the channel for other kinds.
  UnaryCall(ArrivedCall call, const ServerContext& context, UnaryKind kind, Method method);

  void OnCancel() override { machine_->Cancelled(); }
  void OnDone() override;

 private:
  void OnRequest() override;
  void OnRequestsEnded() override { machine_->ReadEnded(); }
  void OnResponseWritten(bool ok) override;

  void StartRead() override { channel().StartRead(&request_); }
  absl::StatusOr<std::uint64_t> Answer(Worker* worker) override;
  void StartWrite() override { channel().StartWrite(&answer_); }
  void Cut() override { channel().Cancel(); }
  void Finish(const absl::Status& status) override;

  const Method method_;
  grpc::ByteBuffer request_, answer_;
  std::shared_ptr<UnaryStateMachine> machine_;
};

}  // namespace partiemc::server
