// Levels of detail of surfaces (proto/PROTOCOL.md, "Levels of detail").
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/surface_level.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// Reads the level that a watcher requests. Errors: INVALID_ARGUMENT (OUT_OF_RANGE) with the field
/// `open.level_of_detail`, or its member.
absl::StatusOr<LevelOfDetail> DecodeLevelOfDetail(const v1::LevelOfDetail& message);
void EncodeLevelOfDetail(const LevelOfDetail& level, v1::LevelOfDetail& message);

/// The mark of a level of detail; absent for an exact surface.
std::optional<SurfaceLevel> LevelOf(const v1::ReconstructedFrame& message);

/// Replaces the surface of `message` by a level in the same coordinate format, with the same origin
/// and step. All other fields, measures and identities stay. A message without a surface stays as
/// it is. Calls `reserve` once, with an estimate of the memory, and returns its error. `cancelled`:
/// as MakeLevel. Runs in the caller's Arena. Errors: DATA_LOSS for a malformed surface, and as
/// MakeLevel; OUT_OF_RANGE (RESOLUTION) if a compact level does not fit its `step`. After an error
/// `message` is unspecified. May throw std::bad_alloc.
absl::Status ReplaceByLevel(const LevelOfDetail& level, SurfaceOrigin origin,
                            absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve,
                            const std::atomic<bool>* cancelled, v1::ReconstructedFrame& message);

}  // namespace partiemc::wire
