#include "server/stream/checkpoint.h"

#include <cstddef>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "core/internal/research.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"
#include "server/base/name_pattern.h"

namespace partiemc::server {
namespace {

// Layout of a checkpoint, little-endian:
// - header: magic, version, method version, is_signed, lineage (LineageOf the stream token);
// - fingerprint of the parameters, fingerprint of the labels, outputs, checkpoint interval;
// - next sequence number, length of the stream's name, the name, checksum of all bytes so far;
// - the state, with its own checksum;
// - the signature of all bytes so far, if is_signed.
constexpr std::uint32_t kMagic = 0x43504d45;  // "EMPC"
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kLineageBytes = 32;
constexpr std::size_t kHeaderBytes = 4 * 4 + kLineageBytes + 2 * 8 + 2 * 4 + 8 + 4;
constexpr std::size_t kChecksumBytes = 8;
static_assert(kHeaderBytes + kMaxStreamNameBytes + kChecksumBytes +
                  CheckpointKeys::kSignatureBytes <=
              kMaxCheckpointOverhead);

constexpr char kAsSent[] = "must be as a server sent it; start the stream anew";

std::uint64_t FingerprintOf(const ReconstructionParameters& parameters) {
  // Lists each member by name, so a new member does not compile here until it is listed. The
  // compiler does not check that it is also hashed: add that below.
  const auto& [output, placement, fill, spacing, spacing_rule, sizes, boundary, kernel_radius,
               cell_size, reference_radius, surface_offset, attribute_tolerance, normal_memory,
               clean, min_component_area, min_component_particles, plane, slice, isovalue, sections,
               phase_attribute, surface, box, noise_filter, walls, wall_phases, wall_planes] =
      parameters;
  const auto& [thinning_distance, max_drop_particles, simplify, min_component_volume] = surface;
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
  put_small(clean ? (*clean ? 2 : 1) : 0);
  // Also hashes the steps and constants of the default placement. Requests cannot change them, but
  // a server built with other values must refuse the checkpoint.
  const VirtualPlaneVariant method;
  for (const NamedStep& step : AllSteps()) put_small(method.steps.*step.value);
  for (const NamedConstant& constant : AllConstants()) {
    PutNumber(method.constants.*constant.value, bytes);
  }
  PutNumber(min_component_area, bytes);
  PutNumber(min_component_particles, bytes);
  put_small(plane);
  const auto put_slice = [&](const SlicePlane& plane_of) {
    for (const double value : plane_of.origin) PutNumber(value, bytes);
    for (const double value : plane_of.normal) PutNumber(value, bytes);
  };
  if (slice) put_slice(*slice);
  // From here on, absent parameters and default values add no bytes. So a checkpoint that was
  // written before these parameters existed stays valid.
  if (attribute_tolerance != ReconstructionParameters().attribute_tolerance) {
    put_small('t');  // Distinguishes the tolerance from an isovalue.
    PutNumber(attribute_tolerance, bytes);
  }
  if (output != Output::kOutline) {
    put_small('o');
    put_small(output);
    PutNumber(thinning_distance, bytes);
    PutNumber(max_drop_particles, bytes);
    PutNumber(simplify, bytes);
    PutNumber(min_component_volume, bytes);
  }
  if (isovalue) PutNumber(*isovalue, bytes);
  for (const Section& section : sections) {
    put_small(section.slice.has_value());
    if (section.slice) put_slice(*section.slice);
    put_optional(section.isovalue);
    if (!section.phase) continue;
    put_small('p');
    put_small(*section.phase);
    bytes += phase_attribute;
  }
  if (box) {
    put_small('b');
    for (const std::optional<PeriodicAxis>& axis : box->axes) {
      put_small(axis.has_value());
      PutNumber(axis.value_or(PeriodicAxis{}).origin, bytes);
      PutNumber(axis.value_or(PeriodicAxis{}).length, bytes);
    }
    if (box->wraps) put_small('w');
  }
  if (noise_filter) {
    put_small('n');
    PutNumber(*noise_filter, bytes);
  }
  if (sizes != Sizes::kEqual) {
    put_small('s');
    put_small(sizes);
  }
  if (boundary != Boundary::kBulk) {
    put_small('b');
    put_small(boundary);
  }
  for (const Wall& wall : walls) {
    put_small('l');
    PutNumber(std::uint64_t{wall.points.size()}, bytes);
    for (const double coordinate : wall.points) PutNumber(coordinate, bytes);
  }
  for (const std::int32_t phase : wall_phases) {
    put_small('x');
    put_small(phase);
    bytes += phase_attribute;
  }
  for (const WallPlane& wall : wall_planes) {
    put_small('q');
    put_small(wall.axis);
    PutNumber(wall.position, bytes);
    put_small(wall.is_fluid_above);
  }
  return ChecksumOf(bytes);
}

absl::Status Refused(absl::StatusCode code, std::string_view reason, std::string value,
                     std::string rule) {
  return ViolationError(
      code, {std::string(reason), "open.resume.checkpoint", std::move(value), std::move(rule)});
}

absl::Status Corrupt(std::string value) {
  return Refused(absl::StatusCode::kInvalidArgument, kReasonCorruptCheckpoint, std::move(value),
                 kAsSent);
}

absl::Status Mismatch(std::string value, std::string rule) {
  return Refused(absl::StatusCode::kFailedPrecondition, kReasonCheckpointMismatch, std::move(value),
                 std::move(rule));
}

absl::Status CheckSignature(std::string_view bytes, const CheckpointKeys& keys) {
  constexpr std::size_t kTail = CheckpointKeys::kSignatureBytes;
  if (bytes.size() > kTail &&
      keys.Verify(bytes.substr(0, bytes.size() - kTail), bytes.substr(bytes.size() - kTail))) {
    return absl::OkStatus();
  }
  return Refused(absl::StatusCode::kFailedPrecondition, kReasonCheckpointSignature,
                 "not signed by this server's keys",
                 "must come from a server with a key of this one's --checkpoint-key-file; resume "
                 "on such a server, or start the stream anew");
}

struct Header {
  std::uint32_t method_version = 0;
  bool is_signed = false;
  std::uint64_t parameters = 0;  // Their fingerprint.
  StreamTerms terms;
  std::uint64_t next_sequence = 0;
};

absl::StatusOr<Header> TakeHeader(std::string_view& bytes) {
  const std::string_view whole = bytes;
  if (whole.size() < kHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(whole.size(), " bytes"));
  }
  if (TakeNumber<std::uint32_t>(bytes) != kMagic) return Corrupt("other bytes");
  // Checks the version before all other fields, because other versions have another layout.
  if (const auto version = TakeNumber<std::uint32_t>(bytes); version != kVersion) {
    return Mismatch(absl::StrCat("version ", version),
                    absl::StrCat("must be of version ", kVersion, "; resume on the server's like"));
  }
  Header header;
  StreamTerms& terms = header.terms;
  header.method_version = TakeNumber<std::uint32_t>(bytes);
  const auto is_signed = TakeNumber<std::uint32_t>(bytes);
  header.is_signed = is_signed == 1;
  terms.lineage = bytes.substr(0, kLineageBytes);
  bytes.remove_prefix(kLineageBytes);
  header.parameters = TakeNumber<std::uint64_t>(bytes);
  terms.labels = TakeNumber<std::uint64_t>(bytes);
  terms.outputs = TakeNumber<std::uint32_t>(bytes);
  terms.checkpoint_interval = TakeNumber<std::uint32_t>(bytes);
  header.next_sequence = TakeNumber<std::uint64_t>(bytes);
  const auto name_bytes = TakeNumber<std::uint32_t>(bytes);
  if (name_bytes == 0 || name_bytes > kMaxStreamNameBytes ||
      bytes.size() < name_bytes + kChecksumBytes) {
    return Corrupt(absl::StrCat("a name of ", name_bytes, " bytes"));
  }
  terms.name = bytes.substr(0, name_bytes);
  bytes.remove_prefix(name_bytes);
  const std::uint64_t checksum = ChecksumOf(whole.substr(0, whole.size() - bytes.size()));
  if (TakeNumber<std::uint64_t>(bytes) != checksum) return Corrupt("a wrong checksum");
  if (is_signed > 1) return Corrupt("neither signed nor unsigned");
  if (header.next_sequence == 0) return Corrupt("next sequence 0");
  return header;
}

absl::Status CheckBound(const Header& header, const ReconstructionParameters& parameters,
                        const StreamTerms& terms) {
  if (header.method_version != kMethodVersion) {
    return Mismatch(absl::StrCat("method version ", header.method_version),
                    absl::StrCat("must be of method version ", kMethodVersion,
                                 "; resume on a server of that version, or start the stream anew"));
  }
  const StreamTerms& made = header.terms;
  const std::pair<bool, const char*> differences[] = {
      {made.lineage != terms.lineage, "another stream"},
      {header.parameters != FingerprintOf(parameters), "other parameters"},
      {made.outputs != terms.outputs, "other outputs"},
      {made.checkpoint_interval != terms.checkpoint_interval, "another checkpoint_interval"},
      {made.labels != terms.labels, "other labels"},
      {!terms.name.empty() && made.name != terms.name, "another stream_name"}};
  for (const auto& [differs, what] : differences) {
    if (differs) return Mismatch(what, "must be resumed with all of `open` that it was made with");
  }
  return absl::OkStatus();
}

}  // namespace

std::uint64_t FingerprintOf(const std::map<std::string, std::string>& labels) {
  std::string bytes;
  for (const auto& [key, value] : labels) {
    for (const std::string& text : {key, value}) {
      PutNumber(std::uint64_t{text.size()}, bytes);
      bytes += text;
    }
  }
  return ChecksumOf(bytes);
}

std::string Serialize(std::uint64_t next_sequence, const State& state,
                      const ReconstructionParameters& parameters, const StreamTerms& terms,
                      const CheckpointKeys* keys) {
  const std::string state_bytes = partiemc::Serialize(state);
  std::string bytes;
  bytes.reserve(kMaxCheckpointOverhead + state_bytes.size());
  PutNumber(kMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(kMethodVersion, bytes);
  PutNumber(std::uint32_t{keys != nullptr}, bytes);
  bytes += terms.lineage;
  PutNumber(FingerprintOf(parameters), bytes);
  PutNumber(terms.labels, bytes);
  PutNumber(terms.outputs, bytes);
  PutNumber(terms.checkpoint_interval, bytes);
  PutNumber(next_sequence, bytes);
  PutNumber(static_cast<std::uint32_t>(terms.name.size()), bytes);
  bytes += terms.name;
  PutNumber(ChecksumOf(bytes), bytes);
  bytes += state_bytes;
  if (keys != nullptr) bytes += keys->Sign(bytes);
  return bytes;
}

absl::StatusOr<Checkpoint> ParseCheckpoint(std::string_view bytes,
                                           const ReconstructionParameters& parameters,
                                           const StreamTerms& terms, const CheckpointKeys* keys) {
  if (bytes.empty()) return Checkpoint{.name = terms.name};
  if (keys != nullptr) {
    if (auto status = CheckSignature(bytes, *keys); !status.ok()) return status;
  }
  auto header = TakeHeader(bytes);
  if (!header.ok()) return header.status();
  if (auto status = CheckBound(*header, parameters, terms); !status.ok()) return status;
  if (header->is_signed) {
    if (bytes.size() < CheckpointKeys::kSignatureBytes) return Corrupt("a signature cut off");
    bytes.remove_suffix(CheckpointKeys::kSignatureBytes);
  }
  auto state = ParseState(bytes);
  if (!state.ok()) {
    return Refused(absl::StatusCode::kInvalidArgument, kReasonCorruptState,
                   FindViolation(state.status())->value, kAsSent);
  }
  return Checkpoint{.next_sequence = header->next_sequence,
                    .name = std::move(header->terms.name),
                    .state = *std::move(state)};
}

}  // namespace partiemc::server
