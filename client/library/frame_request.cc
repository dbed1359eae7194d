#include "client/library/frame_request.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "client/library/channel.h"
#include "partiemc/status.h"
#include "wire/message_bytes.h"

namespace partiemc::client {
namespace {

// Maximum size of a gRPC message minus the fields around the frame.
constexpr std::uint64_t kMaxFrameBytes = std::numeric_limits<std::int32_t>::max() - 64;

}  // namespace

absl::Status CheckParticleCount(std::size_t particles, const StreamLimits& limits) {
  const std::uint64_t limit = limits.max_particles_per_frame;
  if (limit == 0 || particles <= limit) return absl::OkStatus();
  return ViolationError(absl::StatusCode::kResourceExhausted,
                        {.reason = std::string(kReasonTooManyParticles),
                         .field = "positions",
                         .value = absl::StrCat(particles, " particles"),
                         .rule = absl::StrCat("the server takes at most ", limit)});
}

absl::StatusOr<grpc::ByteBuffer> EncodeFrameRequest(const wire::FrameRows& frame,
                                                    std::uint64_t sequence,
                                                    const StreamLimits& limits) {
  const wire::FrameRequest request(frame, sequence);
  const std::uint64_t bytes = request.frame_bytes();
  const std::uint64_t announced = limits.max_frame_bytes;
  const std::uint64_t limit = announced == 0 ? kMaxFrameBytes : std::min(announced, kMaxFrameBytes);
  if (bytes > limit) {
    return ViolationError(absl::StatusCode::kResourceExhausted,
                          {.reason = "MESSAGE_TOO_LARGE",
                           .field = "frame",
                           .value = absl::StrCat(bytes, " bytes"),
                           .rule = absl::StrCat("the server takes at most ", limit)});
  }
  return request.ToBytes();
}

absl::Status SendTimeout(std::chrono::milliseconds timeout) {
  return ViolationError(
      absl::StatusCode::kDeadlineExceeded,
      {.reason = "SEND_TIMEOUT",
       .field = "frame",
       .value = "not sent",
       .rule = absl::StrCat("gets a place in the window within ", Seconds(timeout),
                            "; send it again, or a later one")});
}

}  // namespace partiemc::client
