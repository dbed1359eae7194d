// A serialised state: the bytes themselves, and with magic number, version and checksum corrected,
// so that these do not stop the reader. A stream continues from an accepted state.
#include "partiemc/state.h"

#include <string>

#include "core/internal/byte_string.h"
#include "fuzz/choices.h"
#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "partiemc/status.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kMarkBytes = 8;  // Magic number and version.
constexpr std::size_t kChecksumBytes = 8;

std::string PutRight(std::string_view bytes) {
  static const auto* const kMark = new std::string(Serialize(State{}).substr(0, kMarkBytes));
  std::string state = *kMark;
  if (bytes.size() > kMarkBytes + kChecksumBytes) {
    state += bytes.substr(kMarkBytes, bytes.size() - kMarkBytes - kChecksumBytes);
  }
  PutNumber(ChecksumOf(state), state);
  return state;
}

std::optional<State> Parse(std::string_view bytes) {
  const auto state = ParseState(bytes);
  if (state.ok()) return *state;
  RequireViolation(state.status());
  Require(FindViolation(state.status())->reason == kReasonCorruptState,
          "bytes that are no state are CORRUPT_STATE");
  return std::nullopt;
}

}  // namespace

void AttackState(Bytes bytes) {
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileParameters(choices);
  // The frames come first, so that the state is the rest.
  const std::string_view frames = choices.TakeText(choices.Take<std::uint8_t>());
  const std::string_view rest = choices.TakeRest();
  Parse(rest);
  const std::string right = PutRight(rest);
  if (const auto state = Parse(right)) {
    Require(Parse(Serialize(*state)).has_value(), "a state that was accepted is accepted again");
    Choices of_frames(Bytes(reinterpret_cast<const std::uint8_t*>(frames.data()), frames.size()));
    AttackStream(of_frames, parameters, *state, 2);
  }
}

}  // namespace partiemc::fuzz
