// Why a call has ended before its stream, and whether another call may do better.
#pragma once

#include <grpcpp/grpcpp.h>

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "client/library/stream_call.h"

namespace partiemc::client {

struct Loss {
  absl::Status status;  ///< One line that names the server; never OK.
  std::string why;      ///< In a few words.
  bool retryable = false;
};

/// Whether a call that ended with these has lost its connection or its server, rather than been
/// refused.
bool IsLostConnection(grpc::StatusCode code, std::string_view reason);

/// What a call was for.
enum class CallPurpose {
  kOpen,
  kResume,
  kJoin,  ///< As another part than 0.
};

/// Of a call that is done. A server that gives a reason has decided: only its going away is
/// retryable and, unless a stream was to be opened, what another replica or a moment may change; of
/// a part also that part 0 is not there. Without a reason the
/// connection has ended the call, in words that depend on what was between: UNAVAILABLE for none,
/// INTERNAL, UNKNOWN or CANCELLED for a proxy, OK for one that closes politely.
Loss LossOf(const StreamCall& call, CallPurpose purpose);

}  // namespace partiemc::client
