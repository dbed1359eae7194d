// The bytes of a SurfaceState. Little-endian layout: magic, version, cell size and time (kAbsent:
// none), largest identity, the box if the version is kSurfaceVersionWithBox, the numbers of shells,
// runs and samples, these arrays, checksum.
#include "partiemc/surface_state.h"

#include <tuple>
#include <type_traits>

#include "partiemc/state.h"
#include "state/history_checks.h"
#include "state/state_bytes.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kSurfaceMagic = 0x42504d45;  // "EMPB"
constexpr std::uint32_t kSurfaceVersion = 1, kSurfaceVersionWithBox = 2;

// The arrays of a state in the order of the layout.
constexpr std::array<ArrayKind, 3> kSurfaceKinds = {
    {{"shells", 40}, {"runs", 20}, {"samples", 24}}};
using SurfaceCounts = std::array<std::uint64_t, kSurfaceKinds.size()>;
constexpr std::size_t kSurfaceHeaderBytes = 4 + 4 + 3 * 8 + 8 * kSurfaceKinds.size();

auto ShellArraysOf(auto& state) {
  auto& history = state.history;
  return std::tie(history.shells, history.runs, history.samples);
}

// The members of an element in the order of the layout.
auto ShellNumbersOf(auto& item) {
  using Item = std::remove_cvref_t<decltype(item)>;
  if constexpr (std::is_same_v<Item, KnownShell>) {
    return std::tie(item.identity, item.is_cavity, item.outer, item.velocity_x, item.velocity_y,
                    item.velocity_z);
  } else if constexpr (std::is_same_v<Item, ShellRun>) {
    return std::tie(item.layer, item.row, item.first, item.last, item.shell);
  } else {
    return std::tie(item.hash, item.x, item.y, item.z, item.shell);
  }
}

absl::Status CheckSurfaceState(const SurfaceState& state) {
  const double cell_size = state.cell_size.value_or(1);
  if (!(cell_size >= 1e-62 && cell_size <= 1e62)) {
    return Corrupt(absl::StrCat("cell size ", ShortestNumber(cell_size)),
                   "must be absent or a length");
  }
  absl::Status status = CheckIdentitiesAndTime(state.history);
  if (status.ok()) status = CheckHistoryArrays<ShellPieces>(state.history);
  return status;
}

SurfaceCounts SurfaceCountsOf(const SurfaceState& state) {
  return {state.history.shells.size(), state.history.runs.size(), state.history.samples.size()};
}

}  // namespace

std::size_t SerializedBytes(const SurfaceState& state) {
  return kSurfaceHeaderBytes + BoxBytes(state.history.box) +
         BytesOf(kSurfaceKinds, SurfaceCountsOf(state)) + kChecksumBytes;
}

std::string Serialize(const SurfaceState& state) {
  std::string bytes;
  bytes.reserve(SerializedBytes(state));
  PutNumber(kSurfaceMagic, bytes);
  PutNumber(state.history.box ? kSurfaceVersionWithBox : kSurfaceVersion, bytes);
  PutOptional(state.cell_size, bytes);
  PutOptional(state.history.time, bytes);
  PutNumber(state.history.identities_given, bytes);
  PutBox(state.history.box, bytes);
  for (const std::uint64_t count : SurfaceCountsOf(state)) PutNumber(count, bytes);
  PutArrays(
      ShellArraysOf(state), [](const auto& item) { return ShellNumbersOf(item); }, bytes);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes;
}

absl::StatusOr<SurfaceState> ParseSurfaceState(std::string_view bytes) {
  if (bytes.size() < kSurfaceHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(bytes.size(), " bytes"),
                   absl::StrCat("must have at least ", kSurfaceHeaderBytes + kChecksumBytes));
  }
  std::string_view rest = bytes.substr(0, bytes.size() - kChecksumBytes);
  if (TakeNumber<std::uint32_t>(rest) != kSurfaceMagic) {
    return Corrupt("another kind of data", "must be the state of a stream of surfaces");
  }
  const auto has_box = TakeVersion(rest, kSurfaceVersion, kSurfaceVersionWithBox);
  if (!has_box.ok()) return has_box.status();
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  SurfaceState state;
  state.cell_size = TakeOptional(rest);
  state.history.time = TakeOptional(rest);
  state.history.identities_given = TakeNumber<std::uint64_t>(rest);
  if (*has_box && bytes.size() < kSurfaceHeaderBytes + kBoxBytes + kChecksumBytes) {
    return Corrupt("a box cut off", kAsWritten);
  }
  if (absl::Status status = TakeBox(*has_box, rest, state.history.box); !status.ok()) return status;
  const auto counts = TakeCounts(kSurfaceKinds, rest);
  if (!counts.ok()) return counts.status();
  const auto numbers_of = [](auto& item) { return ShellNumbersOf(item); };
  if (!TakeArrays(*counts, numbers_of, rest, ShellArraysOf(state))) {
    return Corrupt("a shell of another kind", "must be of kind 0 or 1");
  }
  if (absl::Status status = CheckSurfaceState(state); !status.ok()) return status;
  return state;
}

}  // namespace partiemc
