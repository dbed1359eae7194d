// partiemc.v1.ReconstructionService over gRPC's callback API, every method as a stream of bytes.
#pragma once

#include "server/calls/methods.h"
#include "server/rpc/byte_service.h"

namespace partiemc::server {

class Service final : public ByteService {
 public:
  /// `methods` outlives the service.
  explicit Service(const Methods& methods);
};

}  // namespace partiemc::server
