#include "server/health_check.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace partiemc::server {

absl::Status CheckHealth(const Address& address, std::chrono::milliseconds timeout) {
  namespace health = grpc::health::v1;
  const auto stub = health::Health::NewStub(
      grpc::CreateChannel(address.ToString(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  health::HealthCheckRequest request;
  request.set_service("partiemc.v1.ReconstructionService");
  health::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, request, &response);
  if (!status.ok()) {
    return absl::UnavailableError(absl::StrCat("no healthy server at ", address.ToString(), ": ",
                                               status.error_message(),
                                               "; is it running, and is this its --address?"));
  }
  if (response.status() != health::HealthCheckResponse::SERVING) {
    return absl::UnavailableError(
        absl::StrCat("the server at ", address.ToString(), " is not serving; it is draining"));
  }
  return absl::OkStatus();
}

}  // namespace partiemc::server
