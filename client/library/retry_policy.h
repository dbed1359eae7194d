// Decides why a call ended early and whether a retry can succeed.
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/library/stream_call.h"

namespace partiemc::client {

struct Loss {
  absl::Status status;  ///< One line that names the server; never OK.
  std::string why;      ///< Short cause for messages.
  bool retryable = false;
};

/// True if a call with this status lost its connection or its server, false if it was refused. With
/// a reason of the server only DRAINING counts as lost. Without one, OK, UNAVAILABLE, INTERNAL,
/// UNKNOWN and CANCELLED do.
bool IsLostConnection(grpc::StatusCode code, std::string_view reason);

/// Purpose of a call.
enum class CallPurpose {
  kOpen,
  kResume,
  kJoin,  ///< A part other than 0.
};

/// Classifies the end of a call. Requires: the call is done.
///
/// A status with a reason is a decision of the server. DRAINING is always retryable. With kResume,
/// refusals that another replica or a later attempt can change are retryable too. With kJoin, the
/// absence of part 0 is retryable too.
///
/// A status without a reason usually means a lost connection, which is retryable. Its code then
/// depends on the intermediary: UNAVAILABLE without an intermediary; INTERNAL, UNKNOWN or CANCELLED
/// with a proxy; OK with a proxy that closes cleanly.
Loss LossOf(const StreamCall& call, CallPurpose purpose);

}  // namespace partiemc::client
