// A serialised state: the bytes themselves, and with magic number, version and checksum corrected,
// so that these do not stop the reader. A stream continues from an accepted state. The same for the
// state of surfaces.
#include "partiemc/state.h"

#include <span>
#include <string>
#include <vector>

#include "core/internal/byte_string.h"
#include "fuzz/choices.h"
#include "fuzz/hostile_frames.h"
#include "fuzz/require.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"

namespace partiemc::fuzz {
namespace {

constexpr std::size_t kMarkBytes = 8;  // Magic number and version.
constexpr std::size_t kChecksumBytes = 8;

// Gives bytes the mark of `like` and a right checksum.
std::string PutRight(std::string_view bytes, const auto& like) {
  std::string state = Serialize(like).substr(0, kMarkBytes);
  if (bytes.size() > kMarkBytes + kChecksumBytes) {
    state += bytes.substr(kMarkBytes, bytes.size() - kMarkBytes - kChecksumBytes);
  }
  PutNumber(ChecksumOf(state), state);
  return state;
}

template <typename AnyState>
std::optional<AnyState> Parsed(const absl::StatusOr<AnyState>& state) {
  if (state.ok()) return *state;
  RequireViolation(state.status());
  Require(FindViolation(state.status())->reason == kReasonCorruptState,
          "bytes that are no state are CORRUPT_STATE");
  return std::nullopt;
}

std::optional<State> Parse(std::string_view bytes) { return Parsed(ParseState(bytes)); }

// Whether some frames more give a state that ParseState accepts: at most 2^62 identities. Only a
// hostile state has as many.
bool HasIdentitiesLeft(const auto& state) {
  return state.history.identities_given < std::uint64_t{1} << 61;
}

// Two frames of a drop and of its halves after a state.
void ContinueSurfaces(SurfaceState state) {
  static const auto reconstructor = SurfaceReconstructor::Create({});
  static auto* const workspace = new SurfaceWorkspace;
  const std::vector<double> xyz = {0, 0, 0, 1, 0, 0, 0, 1, 0, 9, 9, 9};
  const std::vector<std::uint64_t> ids = {1, 2, 3, 4};
  const std::vector<float> velocities(xyz.size(), 1e30f);
  Surface surface;
  state.cell_size.reset();
  for (const double time : {0.0, 1.0}) {
    const absl::Status status =
        reconstructor->Reconstruct({.positions = std::span<const double>(xyz),
                                    .components = 3,
                                    .ids = ids,
                                    .velocities = velocities,
                                    .time = time},
                                   state, *workspace, surface);
    Require(status.ok(), "any accepted state can be continued");
    const auto again = ParseSurfaceState(Serialize(state));
    Require(again.ok() && *again == state, "the state of a surface reads back the same");
  }
}

void AttackSurfaceState(std::string_view bytes) {
  Parsed(ParseSurfaceState(bytes));
  const auto state = Parsed(ParseSurfaceState(PutRight(bytes, SurfaceState{})));
  if (state && HasIdentitiesLeft(*state)) ContinueSurfaces(*state);
}

}  // namespace

void AttackState(Bytes bytes) {
  Choices choices(bytes);
  const ReconstructionParameters parameters = HostileParameters(choices);
  // The frames come first, so that the state is the rest.
  const std::string_view frames = choices.TakeText(choices.Take<std::uint8_t>());
  const std::string_view rest = choices.TakeRest();
  AttackSurfaceState(rest);
  Parse(rest);
  // The state of a stream of surfaces, with its sections.
  if (const auto state = Parse(PutRight(rest, State{.surface = {.cell_size = 1}}))) {
    Require(Parse(Serialize(*state)) == state, "a state of surfaces reads back the same");
  }
  const std::string right = PutRight(rest, State{});
  if (const auto state = Parse(right)) {
    Require(Parse(Serialize(*state)).has_value(), "a state that was accepted is accepted again");
    if (!HasIdentitiesLeft(*state)) return;
    Choices of_frames(Bytes(reinterpret_cast<const std::uint8_t*>(frames.data()), frames.size()));
    AttackStream(of_frames, parameters, *state, 2);
  }
}

}  // namespace partiemc::fuzz
