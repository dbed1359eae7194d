// The interface that carries the messages of one call. The calls (ByteCall) interpret the messages.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// Connects a call to its client over gRPC (server/rpc/grpc_call.h) or another transport. Each
/// message is a grpc::ByteBuffer, whose slices can be shared. No function blocks; any thread may
/// call. The state machines of the calls keep these rules: at most one read and one write are in
/// progress, and Finish is called once, after the last write.
class CallChannel {
 public:
  virtual ~CallChannel() = default;

  /// Reads the next message into `message`, which lives until ByteCall::OnReadDone.
  virtual void StartRead(grpc::ByteBuffer* message) = 0;
  /// Writes `message`, which lives until ByteCall::OnWriteDone.
  virtual void StartWrite(const grpc::ByteBuffer* message) = 0;
  /// Makes the pending read and write fail soon.
  virtual void Cancel() = 0;
  /// Sends the status of the call to the client.
  virtual void Finish(const absl::Status& status) = 0;

  /// Called after a failed read. Returns true if the call was cancelled: the client disconnected or
  /// broke the protocol, or Cancel was called. Returns false if the client has half-closed.
  virtual bool IsCancelled() const = 0;
  /// Address of the client in gRPC's format: "ipv4:192.0.2.7:51234".
  virtual std::string peer() const = 0;
};

}  // namespace partiemc::server
