#include "client/library/answer.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"

namespace partiemc::client {
namespace {

// Limits the client's memory: a server may announce a window of any size.
constexpr std::size_t kMaxFramesInFlight = 64;

}  // namespace

absl::StatusOr<StreamInfo> ReadOpened(const v1::StreamOpened& opened,
                                      const ReconstructionParameters& requested) {
  auto parameters = wire::DecodeParameters(opened.parameters());
  if (!parameters.ok()) return parameters.status();
  // An older server ignores parameters that it does not know, and returns other values.
  if (requested.output == Output::kSurface && parameters->output != requested.output) {
    return absl::UnimplementedError("the server does not support surfaces: use a newer one");
  }
  if (parameters->box != requested.box) {
    return absl::UnimplementedError("the server does not support periodic boxes: use a newer one");
  }
  if (parameters->noise_filter != requested.noise_filter) {
    return absl::UnimplementedError("the server does not support noise filters: use a newer one");
  }
  if (parameters->sizes != requested.sizes) {
    return absl::UnimplementedError("the server does not support own sizes: use a newer one");
  }
  if (!std::ranges::equal(parameters->sections, requested.sections, {}, &Section::phase,
                          &Section::phase)) {
    return absl::UnimplementedError("the server does not support phases: use a newer one");
  }
  if (parameters->boundary != requested.boundary) {
    return absl::UnimplementedError("the server does not support grains: use a newer one");
  }
  if (parameters->walls != requested.walls || parameters->wall_phases != requested.wall_phases) {
    return absl::UnimplementedError("the server does not support walls: use a newer one");
  }
  if (parameters->wall_planes != requested.wall_planes) {
    return absl::UnimplementedError(
        "the server does not support walls of surfaces: use a newer one");
  }
  return StreamInfo{
      .stream_id = opened.stream_id(),
      .parameters = *parameters,
      .frames_in_flight = std::clamp<std::size_t>(opened.frames_in_flight(), 1, kMaxFramesInFlight),
      .limits = {.max_particles_per_frame = opened.limits().max_particles_per_frame(),
                 .max_frame_bytes = opened.limits().max_frame_bytes(),
                 .max_tiles_per_frame = opened.limits().max_tiles_per_frame()},
      .frame_boxes = opened.frame_boxes()};
}

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
