// Encodes the summary of an open stream.
#pragma once

#include <chrono>

#include "partiemc/v1/reconstruction.pb.h"
#include "server/stream/stream_registry.h"

namespace partiemc::server {

void EncodeSummary(const StreamSummary& stream, std::chrono::steady_clock::time_point now,
                   v1::StreamSummary& message);

}  // namespace partiemc::server
