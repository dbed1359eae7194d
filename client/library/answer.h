// What a server's message means to the receiver of a stream.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/codec.h"

namespace partiemc::client {

/// Whether `response` answers a frame, or a part of one.
bool IsAnswer(const v1::ReconstructResponse& response);

/// The number of the frame that `response` answers; 0 where it answers none.
std::uint64_t AnsweredSequence(const v1::ReconstructResponse& response);

/// Fills `event` with what `response` says; it is not StreamOpened. Buffers of `event` are used
/// again; `scratch` belongs to this function.
/// Errors: DATA_LOSS, naming the server at `address`, for what makes no sense.
absl::Status DecodeAnswer(const v1::ReconstructResponse& response, const std::string& address,
                          wire::ReconstructedFrame& scratch, Event& event);

}  // namespace partiemc::client
