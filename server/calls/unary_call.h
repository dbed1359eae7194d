// A call of one request and one response, over any channel.
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
#include "server/stream/unary_registry.h"
#include "server/stream/unary_state_machine.h"

namespace partiemc::server {

class UnaryCall final : public ByteCall, private UnaryTransport {
 public:
  /// Turns a request into a response, unless `cancelled`. May clear the request. A call for
  /// information has no worker.
  using Method = std::function<absl::StatusOr<grpc::ByteBuffer>(
      grpc::ByteBuffer& request, Worker* worker, const std::atomic<bool>& cancelled)>;

  UnaryCall(ArrivedCall call, const ServerContext& context, UnaryKind kind, Method method);

  void OnCancel() override;
  void OnDone() override;

 private:
  void ReadDone(bool ok) override;
  void WriteDone(bool ok) override;
  void StartRead() override;
  absl::StatusOr<std::uint64_t> Answer(Worker* worker) override;
  void StartWrite() override;
  void Cut() override;
  void Finish(const absl::Status& status) override;

  UnaryRegistry& calls_;
  const Method method_;
  grpc::ByteBuffer request_, answer_;
  std::shared_ptr<UnaryStateMachine> machine_;
};

}  // namespace partiemc::server
