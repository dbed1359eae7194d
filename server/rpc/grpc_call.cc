#include "server/rpc/grpc_call.h"

#include <iterator>

#include "server/rpc/grpc_status.h"

namespace partiemc::server {

GrpcCall::GrpcCall(grpc::CallbackServerContext& context, const Make& make)
    : context_(context), call_(make(*this, OriginOf(context))) {}

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
