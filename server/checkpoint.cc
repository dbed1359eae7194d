#include "server/checkpoint.h"

#include <cstddef>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/byte_string.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"

namespace partiemc::server {
namespace {

// Layout, little-endian: magic, version, version of the method, fingerprint of the parameters, next
// sequence number, checksum of all that, state, which has a checksum of its own.
constexpr std::uint32_t kMagic = 0x43504d45;  // "EMPC"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 4 + 4 + 4 + 8 + 8;
constexpr std::size_t kChecksumBytes = 8;

// The numbers that parameters are made of, one after the other.
std::uint64_t FingerprintOf(const ReconstructionParameters& parameters) {
  // Names each part, so that a new one does not compile until it is bound, too.
  const auto& [placement, fill, spacing, spacing_rule, kernel_radius, cell_size, reference_radius,
               surface_offset, normal_memory, outline_memory, clean, steps, min_component_area,
               min_component_particles, plane] = parameters;
  const auto& [edge_vertices, normals, curvature, support, smoothing, area] = steps;
  std::string bytes;
  const auto put_small = [&](auto value) { PutNumber(static_cast<std::uint32_t>(value), bytes); };
  const auto put_optional = [&](std::optional<double> value) {
    put_small(value.has_value());
    PutNumber(value.value_or(0), bytes);
  };
  put_small(placement);
  put_small(fill);
  put_optional(spacing);
  put_small(spacing_rule);
  PutNumber(kernel_radius, bytes);
  PutNumber(cell_size, bytes);
  put_optional(reference_radius);
  PutNumber(surface_offset, bytes);
  put_small(normal_memory);
  put_small(outline_memory);
  put_small(clean ? (*clean ? 2 : 1) : 0);
  for (const bool step : {edge_vertices, normals, curvature, support, smoothing, area}) {
    put_small(step);
  }
  PutNumber(min_component_area, bytes);
  PutNumber(min_component_particles, bytes);
  put_small(plane);
  return ChecksumOf(bytes);
}

absl::Status Refused(absl::StatusCode code, std::string_view reason, std::string value,
                     std::string rule) {
  return ViolationError(
      code, {std::string(reason), "open.resume.checkpoint", std::move(value), std::move(rule)});
}

absl::Status Corrupt(std::string value) {
  return Refused(absl::StatusCode::kInvalidArgument, kReasonCorruptCheckpoint, std::move(value),
                 "must be as a server sent it; start the stream anew");
}

absl::Status Mismatch(std::string value, std::string rule) {
  return Refused(absl::StatusCode::kFailedPrecondition, kReasonCheckpointMismatch, std::move(value),
                 std::move(rule));
}

}  // namespace

std::string Serialize(const Checkpoint& checkpoint, const ReconstructionParameters& parameters) {
  const std::string state = partiemc::Serialize(checkpoint.state);
  std::string bytes;
  bytes.reserve(kHeaderBytes + kChecksumBytes + state.size());
  PutNumber(kMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(kMethodVersion, bytes);
  PutNumber(FingerprintOf(parameters), bytes);
  PutNumber(checkpoint.next_sequence, bytes);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes += state;
}

absl::StatusOr<Checkpoint> ParseCheckpoint(std::string_view bytes,
                                           const ReconstructionParameters& parameters) {
  Checkpoint checkpoint;
  if (bytes.empty()) return checkpoint;
  if (bytes.size() < kHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(bytes.size(), " bytes"));
  }
  const std::uint64_t checksum = ChecksumOf(bytes.substr(0, kHeaderBytes));
  if (TakeNumber<std::uint32_t>(bytes) != kMagic) return Corrupt("other bytes");
  const auto version = TakeNumber<std::uint32_t>(bytes);
  const auto method_version = TakeNumber<std::uint32_t>(bytes);
  const auto fingerprint = TakeNumber<std::uint64_t>(bytes);
  checkpoint.next_sequence = TakeNumber<std::uint64_t>(bytes);
  if (TakeNumber<std::uint64_t>(bytes) != checksum) return Corrupt("a wrong checksum");
  if (version != kVersion) {
    return Mismatch(absl::StrCat("version ", version),
                    absl::StrCat("must be of version ", kVersion, "; resume on the server's like"));
  }
  if (method_version != kMethodVersion) {
    return Mismatch(absl::StrCat("method version ", method_version),
                    absl::StrCat("must be of method version ", kMethodVersion,
                                 "; resume on a server of that version, or start the stream anew"));
  }
  if (fingerprint != FingerprintOf(parameters)) {
    return Mismatch("other parameters",
                    "must be resumed with the parameters that it was made with");
  }
  if (checkpoint.next_sequence == 0) return Corrupt("next sequence 0");
  auto state = ParseState(bytes);
  if (!state.ok()) return state.status();
  checkpoint.state = *std::move(state);
  return checkpoint;
}

}  // namespace partiemc::server
