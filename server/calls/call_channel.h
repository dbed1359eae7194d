// How the messages of one call travel. The calls (ByteCall) know what they mean.
#pragma once

#include <grpcpp/support/byte_buffer.h>

#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// A call's way to its client and back: gRPC (server/rpc/grpc_call.h), or another transport.
/// Messages are bytes in a grpc::ByteBuffer, whatever carries them: slices that can be shared.
/// Nothing here blocks, and everything may be called from any thread, with these rules, which
/// ByteCall's state machines keep: at most one read and one write go on at once, and Finish comes
/// once, after the last write.
class CallChannel {
 public:
  virtual ~CallChannel() = default;

  /// Reads the next message into `message`, which stays until ByteCall::OnReadDone.
  virtual void StartRead(grpc::ByteBuffer* message) = 0;
  /// Writes `message`, which stays until ByteCall::OnWriteDone.
  virtual void StartWrite(const grpc::ByteBuffer* message) = 0;
  /// Has the read and the write that are going on fail soon.
  virtual void Cancel() = 0;
  /// Tells the client how the call ended.
  virtual void Finish(const absl::Status& status) = 0;

  /// A read that failed did so because nobody is there any more, and not for a half-close.
  virtual bool IsCancelled() const = 0;
  /// Where the client is, as gRPC writes it: "ipv4:192.0.2.7:51234".
  virtual std::string peer() const = 0;
};

}  // namespace partiemc::server
