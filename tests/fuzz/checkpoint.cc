// A checkpoint that comes back from a client: as it comes, and with its header's checksum put
// right. One that is accepted is gone on from.
#include "server/checkpoint.h"

#include <string>

#include "fuzz/choices.h"
#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "partiemc/byte_string.h"
#include "partiemc/status.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kBoundBytes = 20;  // What binds it to versions and parameters.
constexpr std::size_t kSequenceBytes = 8;
constexpr std::size_t kChecksumBytes = 8;

std::optional<server::Checkpoint> Parse(std::string_view bytes,
                                        const ReconstructionParameters& parameters) {
  const auto checkpoint = server::ParseCheckpoint(bytes, parameters);
  if (checkpoint.ok()) return *checkpoint;
  RequireViolation(checkpoint.status());
  const std::string reason = FindViolation(checkpoint.status())->reason;
  Require(reason == server::kReasonCorruptCheckpoint || reason == kReasonCorruptState ||
              reason == server::kReasonCheckpointMismatch,
          "a checkpoint is refused with its reasons");
  return std::nullopt;
}

// A header that is bound to `parameters`, before the number and the state that `bytes` has.
std::string PutRight(std::string_view bytes, const ReconstructionParameters& parameters) {
  std::string checkpoint =
      server::Serialize(server::Checkpoint{}, parameters).substr(0, kBoundBytes);
  checkpoint += bytes.substr(0, kSequenceBytes);
  checkpoint.resize(kBoundBytes + kSequenceBytes);
  PutNumber(ChecksumOf(checkpoint), checkpoint);
  std::string state(bytes.substr(std::min(bytes.size(), kSequenceBytes)));
  if (state.size() >= kChecksumBytes) {
    state.resize(state.size() - kChecksumBytes);
    PutNumber(ChecksumOf(state), state);
  }
  return checkpoint + state;
}

}  // namespace

void AttackCheckpoint(Bytes bytes) {
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileParameters(choices);
  const std::string_view frames = choices.TakeText(choices.Take<std::uint8_t>());
  const std::string_view rest = choices.TakeRest();
  Parse(rest, parameters);
  const auto checkpoint = Parse(PutRight(rest, parameters), parameters);
  if (!checkpoint) return;
  Require(checkpoint->next_sequence > 0, "sequence numbers begin with 1");
  const auto again = Parse(server::Serialize(*checkpoint, parameters), parameters);
  Require(again && again->state == checkpoint->state, "a checkpoint reads back the same");
  Choices of_frames(Bytes(reinterpret_cast<const std::uint8_t*>(frames.data()), frames.size()));
  AttackStream(of_frames, parameters, checkpoint->state, 2);
}

}  // namespace partiemc::fuzz
