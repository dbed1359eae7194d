#include "server/rpc/error_details.h"

#include "common/printable.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "partiemc/status.h"

namespace partiemc::server {

std::string ErrorDetails(const absl::Status& status) {
  const auto violation = FindViolation(status);
  if (status.ok() || !violation) return {};
  // Makes the value printable: Protobuf strings must be UTF-8, and a value that a client sent may
  // not be.
  const std::string value = Printable(violation->value);
  google::rpc::Status details;
  details.set_code(static_cast<int>(status.code()));  // Abseil and gRPC number the codes alike.
  details.set_message(Printable({status.message().data(), status.message().size()}));
  google::rpc::ErrorInfo info;
  info.set_reason(violation->reason);
  info.set_domain(kErrorDomain);
  (*info.mutable_metadata())["field"] = violation->field;
  (*info.mutable_metadata())["value"] = value;
  (*info.mutable_metadata())["rule"] = violation->rule;
  details.add_details()->PackFrom(info);
  if (status.code() == absl::StatusCode::kInvalidArgument) {
    google::rpc::BadRequest request;
    auto& field = *request.add_field_violations();
    field.set_field(violation->field);
    field.set_description(value + "; " + violation->rule);
    details.add_details()->PackFrom(request);
  }
  return details.SerializeAsString();
}

}  // namespace partiemc::server
