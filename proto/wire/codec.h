// The codec: the only place where messages of partiemc.v1 meet the types of the core. The server
// decodes requests and encodes results with it, the client does the reverse.
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

/// The reasons that the codec gives, beside the core's (proto/PROTOCOL.md).
inline constexpr std::string_view kReasonByteCount = "BYTE_COUNT";
inline constexpr std::string_view kReasonUnsupported = "UNSUPPORTED";
using partiemc::kReasonResolution;

/// What a client wants back, as resolved (v1::Outputs).
struct Outputs {
  bool rings = true;
  bool mesh = true;
  bool normals = false;
  bool relative_float32 = false;             ///< COORDINATE_FORMAT_FLOAT32_RELATIVE.
  bool echo_particles = false;               ///< To watchers.
  std::vector<std::string> attributes = {};  ///< Names, all different.

  friend bool operator==(const Outputs&, const Outputs&) = default;
};

/// Milliseconds of wall time, of each stage in their order and of the whole frame.
struct FrameTimes {
  std::array<double, kStageCount> stages_ms{};
  double total_ms = 0;
};

/// A result with what the wire says about it.
struct ReconstructedFrame {
  std::uint64_t sequence = 0;
  double time = 0;
  Result result;  ///< Parts that were not asked for are empty.
  FrameTimes times;
  std::uint64_t rings_digest = 0;
  std::uint64_t mesh_digest = 0;
  std::vector<OutlineDigests> section_digests = {};  ///< Of result.sections.
};

v1::Placement ToWire(Placement placement);
v1::Fill ToWire(Fill fill);
v1::Doubt ToWire(Doubt doubt);

/// Defaults filled in for absent fields; the values are checked by the core's Validate.
/// Errors: INVALID_ARGUMENT with a Violation for an enum value that this version does not know.
absl::StatusOr<ReconstructionParameters> DecodeParameters(
    const v1::ReconstructionParameters& message);
void EncodeParameters(const ReconstructionParameters& parameters,
                      v1::ReconstructionParameters& message);

/// Errors: INVALID_ARGUMENT with a Violation: normals without rings, a format or attributes for
/// nothing, too many attributes or one of them twice.
absl::StatusOr<Outputs> DecodeOutputs(const v1::Outputs& message, bool present);
void EncodeOutputs(const Outputs& outputs, v1::Outputs& message);

/// What the views of a frame's attributes lie in; kept from frame to frame.
struct AttributeViews {
  std::vector<Attribute> carried, chosen;
};

/// A view into `message`, which must outlive it unchanged; as `names` and `views` where particles
/// carry what is named. Checks the format and every byte count
/// against the number of particles, copies nothing; values are checked by the core. No copy is
/// needed for alignment either: a std::string keeps its bytes at a multiple of 8 (asserted).
/// Errors: INVALID_ARGUMENT with a Violation (reasons BYTE_COUNT, UNSUPPORTED, OUT_OF_RANGE of the
/// components of a scalar, NO_SUCH_ATTRIBUTE).
absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message,
                                  std::span<const std::string> names, AttributeViews& views);
/// The same where nothing is named.
absl::StatusOr<Frame> DecodeFrame(const v1::ParticleFrame& message);
/// Replaces what the core uses of `message` (all but its sequence), reusing its buffers.
/// Requires: frame.components is 2 or 3.
void EncodeFrame(const Frame& frame, v1::ParticleFrame& message);

/// Writes everything but sequence, time and checkpoint, reusing the buffers of `message`. Digests
/// are those of the whole result, whatever `outputs` leaves out.
/// Errors: OUT_OF_RANGE with a Violation (reason RESOLUTION) when relative float32 coordinates
/// would move a vertex by more than 1e-4 spacings; rings, mesh and sections of `message` are then
/// absent.
absl::Status EncodeResult(const Result& result, const FrameTimes& times, const Outputs& outputs,
                          v1::ReconstructedFrame& message);

/// The reverse, for clients. The message is untrusted: every count and index is checked.
/// Errors: DATA_LOSS naming the field and the rule that it breaks; `frame.result` is then empty.
absl::Status DecodeResult(const v1::ReconstructedFrame& message, ReconstructedFrame& frame);

/// A FrameError for `status`, with the parts of its Violation; a status without one gives its
/// code's name as reason and its message.
void EncodeFrameError(const absl::Status& status, std::uint64_t sequence,
                      std::uint64_t next_sequence, v1::FrameError& message);

}  // namespace partiemc::wire
