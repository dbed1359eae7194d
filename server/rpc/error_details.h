// Encodes errors in Google's error model.
#pragma once

#include <string>

#include "absl/status/status.h"

namespace partiemc::server {

/// The domain of our reasons (google.rpc.ErrorInfo).
inline constexpr char kErrorDomain[] = "partiemc";

/// Returns a serialised google.rpc.Status for a status with a Violation. It contains an ErrorInfo
/// with the reason and, as metadata, `field`, `value` and `rule`; for INVALID_ARGUMENT also a
/// BadRequest with the field. Empty for any other status. gRPC sends it as
/// `grpc-status-details-bin`.
std::string ErrorDetails(const absl::Status& status);

}  // namespace partiemc::server
