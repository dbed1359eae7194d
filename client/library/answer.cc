#include "client/library/answer.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace partiemc::client {

bool IsAnswer(const v1::ReconstructResponse& response) {
  return response.has_frame() || response.has_error() || response.has_part();
}

std::uint64_t AnsweredSequence(const v1::ReconstructResponse& response) {
  if (response.has_frame()) return response.frame().sequence();
  if (response.has_part()) return response.part().sequence();
  return response.has_error() ? response.error().sequence() : 0;
}

absl::Status DecodeAnswer(const v1::ReconstructResponse& response, const std::string& address,
                          wire::ReconstructedFrame& scratch, Event& event) {
  event.sequence = AnsweredSequence(response);
  if (response.has_frame()) {
    std::swap(scratch.result, event.frame.result);  // Reuses the caller's buffers.
    const absl::Status status = wire::DecodeResult(response.frame(), scratch);
    std::swap(scratch.result, event.frame.result);
    if (!status.ok()) {
      return absl::Status(status.code(), absl::StrCat("the server at ", address, " answered frame ",
                                                      event.sequence, " with ", status.message()));
    }
    event.kind = Event::Kind::kResult;
    event.time = scratch.time;
    event.frame.times = {.stages_ms = scratch.times.stages_ms, .total_ms = scratch.times.total_ms};
    event.frame.rings_digest = scratch.rings_digest;
    event.frame.mesh_digest = scratch.mesh_digest;
    event.frame.surface_digest = scratch.surface_digest;
    std::swap(event.frame.section_digests, scratch.section_digests);
    return absl::OkStatus();
  }
  if (response.has_error()) {
    const v1::FrameError& error = response.error();
    event.kind = Event::Kind::kRefusal;
    event.violation = {.reason = error.reason(),
                       .field = error.field(),
                       .value = error.value(),
                       .rule = error.rule()};
    event.message = error.message();
    return absl::OkStatus();
  }
  if (response.has_part()) {
    event.kind = Event::Kind::kPartTaken;
    return absl::OkStatus();
  }
  if (response.has_notice()) {
    event.kind = Event::Kind::kNotice;
    event.message = response.notice().message();
    return absl::OkStatus();
  }
  return absl::DataLossError(
      absl::StrCat("the server at ", address,
                   " sent a response that this client does not support: use a "
                   "client of the server's version"));
}

}  // namespace partiemc::client
