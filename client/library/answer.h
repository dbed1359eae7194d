// Converts a server's responses to the properties and the events of a stream.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/parameters.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/codec.h"

namespace partiemc::client {

/// Reads the properties of an opened stream. Limits the announced window to 1 to 64 frames, because
/// each frame in flight takes memory. Errors: UNIMPLEMENTED if an older server has ignored a
/// `requested` parameter that it does not know, such as walls; INVALID_ARGUMENT for parameters that
/// cannot be decoded.
absl::StatusOr<StreamInfo> ReadOpened(const v1::StreamOpened& opened,
                                      const ReconstructionParameters& requested);

/// True for a response to a frame or to a part of one.
bool IsAnswer(const v1::ReconstructResponse& response);

/// The number of the frame that `response` answers; 0 if it answers none.
std::uint64_t AnsweredSequence(const v1::ReconstructResponse& response);

/// Fills `event` from `response`, which is not StreamOpened. Reuses the buffers of `event`. The
/// caller keeps `scratch` from call to call, for this function's buffers. Errors: DATA_LOSS with
/// the server's address for a malformed response.
absl::Status DecodeAnswer(const v1::ReconstructResponse& response, const std::string& address,
                          wire::ReconstructedFrame& scratch, Event& event);

}  // namespace partiemc::client
