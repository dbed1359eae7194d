// The codec: only wire/ converts between messages of partiemc.v1 and types of the core. The server
// decodes requests and encodes results, the client encodes requests and decodes results.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "partiemc/stage.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::wire {

/// The reasons of the codec's violations (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonByteCount = "BYTE_COUNT";
inline constexpr std::string_view kReasonUnsupported = "UNSUPPORTED";
using partiemc::kReasonResolution;

/// v1::CoordinateFormat.
enum class Coordinates : std::uint8_t { kFloat64, kRelativeFloat32, kCompact };

/// The requested outputs (v1::Outputs). Defaults as for an absent message.
struct Outputs {
  bool rings = true;
  bool mesh = true;
  bool surface = true;  ///< Has an effect only in streams with Output::kSurface.
  bool normals = false;
  Coordinates coordinates = Coordinates::kFloat64;
  bool echo_particles = false;               ///< Watchers receive the particles, too.
  std::vector<std::string> attributes = {};  ///< Names, all different.

  friend bool operator==(const Outputs&, const Outputs&) = default;
};

/// Wall-clock milliseconds of each stage, in order, and of the whole frame.
struct FrameTimes {
  std::array<double, kStageCount> stages_ms{};
  double total_ms = 0;
};

/// A result with its metadata from the wire.
struct ReconstructedFrame {
  std::uint64_t sequence = 0;
  double time = 0;
  Result result;  ///< Outputs that were not requested are empty.
  FrameTimes times;
  std::uint64_t rings_digest = 0;
  std::uint64_t mesh_digest = 0;
  std::uint64_t surface_digest = 0;
  std::vector<OutlineDigests> section_digests = {};  ///< One for each section of `result`.
};

v1::Output ToWire(Output output);
v1::CoordinateFormat ToWire(Coordinates coordinates);
v1::Placement ToWire(Placement placement);
v1::Fill ToWire(Fill fill);
v1::Doubt ToWire(Doubt doubt);
v1::PeriodicBox ToWire(const PeriodicBox& box);
PeriodicBox FromWire(const v1::PeriodicBox& message);

/// Decodes parameters and fills in defaults. The core's Validate checks the values.
/// Errors: INVALID_ARGUMENT with a Violation for an unknown enum value, and as DecodeWalls and
/// DecodeWallPlanes.
absl::StatusOr<ReconstructionParameters> DecodeParameters(
    const v1::ReconstructionParameters& message);
void EncodeParameters(const ReconstructionParameters& parameters,
                      v1::ReconstructionParameters& message);

/// `present`: whether the request has the message; if not, returns the defaults. Errors:
/// INVALID_ARGUMENT with a Violation for an unknown format, and for more than 16 or repeated
/// attributes. Also for normals without rings and surface, and for a format or attributes without
/// rings, mesh and surface.
absl::StatusOr<Outputs> DecodeOutputs(const v1::Outputs& message, bool present);
void EncodeOutputs(const Outputs& outputs, v1::Outputs& message);

/// Storage for the views of a frame's attributes; reused from frame to frame.
struct AttributeViews {
  std::vector<Attribute> carried, chosen;
};

/// Returns a view into `message` with the attributes `names`, in this order. Copies nothing. Checks
/// the format, and every byte count against the number of particles; the core checks the values.
/// Requires: `message` and `views` outlive the result unchanged. Errors: INVALID_ARGUMENT with a
/// Violation: BYTE_COUNT, UNSUPPORTED, OUT_OF_RANGE for the components of a scalar,
/// NO_SUCH_ATTRIBUTE.
absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message,
                                  std::span<const std::string> names, AttributeViews& views);
/// DecodeFrame without attributes.
absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message);
/// Writes every field of `message` except its sequence. Reuses the buffers of `message`.
/// Requires: frame.components is 2 or 3.
void EncodeFrame(const Frame& frame, v1::ParticleFrame& message);

/// Writes every field except sequence, time and particles. Reuses the buffers of `message`. The
/// digests cover the whole result, even if `outputs` omits a part of it. Errors: OUT_OF_RANGE with
/// a Violation (RESOLUTION) if relative float32 coordinates would move a vertex by more than 1e-4
/// spacings, or if a surface is too large for compact coordinates. Rings, mesh, surface and
/// sections of `message` are then absent.
absl::Status EncodeResult(const Result& result, const FrameTimes& times, const Outputs& outputs,
                          v1::ReconstructedFrame& message);

/// Decodes a result. Checks every count and index, because clients do not trust the message.
/// Errors: DATA_LOSS with the field and the broken rule. `frame.result` is then empty.
absl::Status DecodeResult(const v1::ReconstructedFrame& message, ReconstructedFrame& frame);

/// Writes a FrameError with the message and the Violation of `status`. Without a Violation, the
/// reason is the name of the status code.
void EncodeFrameError(const absl::Status& status, std::uint64_t sequence,
                      std::uint64_t next_sequence, v1::FrameError& message);

}  // namespace partiemc::wire
