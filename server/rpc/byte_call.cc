#include "server/rpc/byte_call.h"

#include "server/rpc/grpc_status.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {

void ByteCall::End(const absl::Status& status) {
  if (ended_.exchange(true)) {
    LogEvent(spdlog::level::err, "a call was ended twice", {{"peer", peer()}});
    return;
  }
  call_.place = {};  // Who hears of the end may come again at once.
  Finish(ToGrpcStatus(status, context_));
}

}  // namespace partiemc::server
