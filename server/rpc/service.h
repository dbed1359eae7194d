// partiemc.v1.ReconstructionService over gRPC's callback API, every method as a stream of bytes.
#pragma once

#include "server/calls/methods.h"
#include "server/connections/connection_table.h"
#include "server/rpc/byte_service.h"

namespace partiemc::server {

class Service final : public ByteService {
 public:
  /// The arguments outlive the service.
  Service(const Methods& methods, const ConnectionTable& connections);
};

}  // namespace partiemc::server
