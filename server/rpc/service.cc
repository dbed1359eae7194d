#include "server/rpc/service.h"

#include <string>

#include "server/calls/requests.h"
#include "server/rpc/grpc_call.h"

namespace partiemc::server {

Service::Service(const Methods& methods, const ConnectionTable& connections) {
  for (const Methods::Method method : Methods::kAll) {
    Serve("/" + ServiceName() + "/" + std::string(Methods::Name(method)),
          [&methods, &connections, method](grpc::CallbackServerContext* context) {
            return new GrpcCall(*context, connections, CallKind::kOther,
                                [&](CallChannel& channel, const CallOrigin& origin) {
                                  return methods.Begin(method, channel, origin);
                                });
          });
  }
}

}  // namespace partiemc::server
