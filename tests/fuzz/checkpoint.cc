// A client's checkpoint: as it is, and with the checksum of its header corrected. A stream resumes
// from an accepted one.
#include "server/stream/checkpoint.h"

#include <string>

#include "core/internal/byte_string.h"
#include "fuzz/choices.h"
#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "partiemc/status.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kSequenceBytes = 8;
constexpr std::size_t kStateChecksumBytes = 8;
const server::StreamTerms kTerms{.lineage = std::string(32, '7'), .name = "tank"};

const server::CheckpointKeys& Keys() {
  static const auto keys = server::CheckpointKeys::Parse("0123456789abcdef");
  return *keys;
}

std::optional<server::Checkpoint> Parse(std::string_view bytes,
                                        const ReconstructionParameters& parameters,
                                        const server::CheckpointKeys* keys = nullptr) {
  const auto checkpoint = server::ParseCheckpoint(bytes, parameters, kTerms, keys);
  if (checkpoint.ok()) return *checkpoint;
  RequireViolation(checkpoint.status());
  const std::string reason = FindViolation(checkpoint.status())->reason;
  Require(reason == server::kReasonCorruptCheckpoint || reason == kReasonCorruptState ||
              reason == server::kReasonCheckpointMismatch ||
              (keys != nullptr && reason == server::kReasonCheckpointSignature),
          "a checkpoint is refused with its reasons");
  return std::nullopt;
}

// A header for `parameters`, followed by the number and the state in `bytes`; signed or not.
std::string PutRight(std::string_view bytes, const ReconstructionParameters& parameters,
                     const server::CheckpointKeys* keys) {
  std::string number(bytes.substr(0, kSequenceBytes));
  number.resize(kSequenceBytes);
  std::string_view rest = number;
  const std::string made =
      server::Serialize(TakeNumber<std::uint64_t>(rest), State{}, parameters, kTerms, keys);
  const std::size_t signature = keys == nullptr ? 0 : server::CheckpointKeys::kSignatureBytes;
  std::string checkpoint = made.substr(0, made.size() - SerializedBytes(State{}) - signature);
  std::string state(bytes.substr(std::min(bytes.size(), kSequenceBytes)));
  if (state.size() >= kStateChecksumBytes) {
    state.resize(state.size() - kStateChecksumBytes);
    PutNumber(ChecksumOf(state), state);
  }
  checkpoint += state;
  return keys == nullptr ? checkpoint : checkpoint + keys->Sign(checkpoint);
}

}  // namespace

void AttackCheckpoint(Bytes bytes) {
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileParameters(choices);
  const std::string_view frames = choices.TakeText(choices.Take<std::uint8_t>());
  const std::string_view rest = choices.TakeRest();
  Parse(rest, parameters);
  Require(rest.empty() || !Parse(rest, parameters, &Keys()), "nobody guesses a signature");
  const auto checkpoint = Parse(PutRight(rest, parameters, nullptr), parameters);
  const std::string with_signature = PutRight(rest, parameters, &Keys());
  const auto signed_one = Parse(with_signature, parameters, &Keys());
  Require(checkpoint.has_value() == signed_one.has_value(), "a signature changes no verdict");
  if (!checkpoint) return;
  Require(checkpoint->next_sequence > 0, "sequence numbers begin with 1");
  Require(signed_one->state == checkpoint->state, "a signature changes no state");
  const auto again = Parse(
      server::Serialize(checkpoint->next_sequence, checkpoint->state, parameters, kTerms, nullptr),
      parameters);
  Require(again && again->state == checkpoint->state, "a checkpoint reads back the same");
  Choices of_frames(Bytes(reinterpret_cast<const std::uint8_t*>(frames.data()), frames.size()));
  AttackStream(of_frames, parameters, checkpoint->state, 2);
}

}  // namespace partiemc::fuzz
