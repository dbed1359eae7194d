#include "server/byte_call.h"

#include "server/grpc_status.h"
#include "server/logging.h"

namespace partiemc::server {

void ByteCall::End(const absl::Status& status) {
  if (ended_.exchange(true)) {
    LogEvent(spdlog::level::err, "a call was ended twice", {{"peer", peer()}});
    return;
  }
  Finish(ToGrpcStatus(status, context_));
}

}  // namespace partiemc::server
