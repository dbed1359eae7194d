#include "server/rpc/grpc_call.h"

#include <iterator>

#include "server/rpc/grpc_status.h"

namespace partiemc::server {

GrpcCall::GrpcCall(grpc::CallbackServerContext& context, const ConnectionTable& connections,
                   CallKind kind, const Make& make)
    : context_(context), tally_(connections.BeginCall(context.peer(), kind)) {
  CallOrigin origin = OriginOf(context);
  origin.is_health_only = tally_.is_health_only();
  call_ = make(*this, origin);
}

void GrpcCall::StartRead(grpc::ByteBuffer* message) {
  tally_.OnReadBegun();
  message_ = message;
  Reactor::StartRead(message);
}

void GrpcCall::OnReadDone(bool ok) {
  // Only a successful read is reported as completed. A failed read may have received part of a
  // message, or a message above the limit. The tally counts it as open until the call ends, so
  // these bytes stay allowed.
  if (ok) tally_.OnReadDone(message_->Length());
  call_->OnReadDone(ok);
}

void GrpcCall::OnDone() {
  call_->OnDone();
  delete this;
}

void GrpcCall::Finish(const absl::Status& status) {
  Reactor::Finish(ToGrpcStatus(status, context_));
}

CallOrigin OriginOf(const grpc::ServerContextBase& context) {
  CallOrigin origin{.peer = context.peer(), .authorization = {}};
  const auto [begin, end] = context.client_metadata().equal_range("authorization");
  if (begin != end && std::next(begin) == end) {
    origin.authorization.emplace(begin->second.data(), begin->second.size());
  }
  return origin;
}

}  // namespace partiemc::server
