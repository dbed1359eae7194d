// The bytes of a state. Little-endian layout: magic, version, cell size and spacing (0: none), area
// offset and time (kAbsent: none), largest identity, the box if the version is kVersionWithBox, the
// numbers of normals, rings, runs and samples, these arrays, checksum.
//
// A state with sections has another magic, the version and the number of states. The states follow,
// the main one first, each with the number of its bytes before it. The checksum is last. The state
// of a stream of surfaces has a third magic and the same layout; its first state is a SurfaceState.
//
// A NoiseHistory is written around these bytes (noise_history.h).
#include "partiemc/state.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "partiemc/parameters.h"
#include "partiemc/status.h"
#include "state/history_checks.h"
#include "state/noise_history.h"
#include "state/state_bytes.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kMagic = 0x53504d45;             // "EMPS"
constexpr std::uint32_t kSectionsMagic = 0x4d504d45;     // "EMPM"
constexpr std::uint32_t kWithSurfaceMagic = 0x55504d45;  // "EMPU"
constexpr std::uint32_t kVersion = 5, kVersionWithBox = 6;

// The arrays of a state in the order of the layout.
constexpr std::array<ArrayKind, 4> kKinds = {
    {{"normals", 16}, {"rings", 32}, {"runs", 16}, {"samples", 20}}};
using Counts = std::array<std::uint64_t, kKinds.size()>;

auto ArraysOf(auto& state) {
  auto& history = state.history;
  return std::tie(state.normals, history.rings, history.runs, history.samples);
}

// The members of an element in the order of the layout.
auto NumbersOf(auto& item) {
  using Item = std::remove_cvref_t<decltype(item)>;
  if constexpr (std::is_same_v<Item, CellNormal>) {
    return std::tie(item.column, item.row, item.x, item.y);
  } else if constexpr (std::is_same_v<Item, KnownRing>) {
    return std::tie(item.identity, item.is_hole, item.outer, item.velocity_x, item.velocity_y);
  } else if constexpr (std::is_same_v<Item, NodeRun>) {
    return std::tie(item.row, item.first, item.last, item.ring);
  } else {
    return std::tie(item.hash, item.column, item.row, item.ring);
  }
}

constexpr std::size_t kHeaderBytes = 4 + 4 + 5 * 8 + 8 * kKinds.size();
constexpr std::size_t kSectionsHeaderBytes = 4 + 4 + 8;

absl::Status CheckLengths(const State& state) {
  const auto is_length = [](double value) { return value >= 1e-62 && value <= 1e62; };
  if (state.cell_size.has_value() != state.spacing.has_value() ||
      !is_length(state.cell_size.value_or(1)) || !is_length(state.spacing.value_or(1))) {
    return Corrupt(absl::StrCat("cell size ", ShortestNumber(state.cell_size.value_or(0)),
                                ", spacing ", ShortestNumber(state.spacing.value_or(0))),
                   "must both be absent or both be lengths");
  }
  const double offset = state.area_offset.value_or(0);
  if (offset >= -1 && offset <= 1) return absl::OkStatus();
  return Corrupt(absl::StrCat("area offset ", ShortestNumber(offset)),
                 "must be absent or in [-1, 1] spacings");
}

absl::Status CheckNormals(const std::vector<CellNormal>& normals) {
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const CellNormal& normal = normals[k];
    const float square = normal.x * normal.x + normal.y * normal.y;
    if (!(square > 0.99f && square < 1.01f)) {
      return Corrupt(absl::StrCat("normal ", k), "must have unit length");
    }
    if (k > 0 && std::tie(normals[k - 1].row, normals[k - 1].column) >=
                     std::tie(normal.row, normal.column)) {
      return Corrupt(absl::StrCat("normal ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckContents(const State& state) {
  absl::Status status = CheckIdentitiesAndTime(state.history);
  if (status.ok()) status = CheckLengths(state);
  if (status.ok()) status = CheckNormals(state.normals);
  if (status.ok()) status = CheckHistoryArrays<RingPieces>(state.history);
  return status;
}

bool HasSurface(const State& state) { return state.surface != SurfaceState{}; }

Counts CountsOf(const State& state) {
  return std::apply([](const auto&... arrays) { return Counts{arrays.size()...}; },
                    ArraysOf(state));
}

std::size_t OwnBytes(const State& state) {
  return kHeaderBytes + BoxBytes(state.history.box) + BytesOf(kKinds, CountsOf(state)) +
         kChecksumBytes;
}

// Appends the state of one outline, without sections and noise.
void PutOwn(const State& state, std::string& bytes) {
  const std::size_t start = bytes.size();
  PutNumber(kMagic, bytes);
  PutNumber(state.history.box ? kVersionWithBox : kVersion, bytes);
  PutNumber(state.cell_size.value_or(0), bytes);
  PutNumber(state.spacing.value_or(0), bytes);
  PutOptional(state.area_offset, bytes);
  PutOptional(state.history.time, bytes);
  PutNumber(state.history.identities_given, bytes);
  PutBox(state.history.box, bytes);
  for (const std::uint64_t count : CountsOf(state)) PutNumber(count, bytes);
  PutArrays(
      ArraysOf(state), [](const auto& item) { return NumbersOf(item); }, bytes);
  PutNumber(ChecksumOf(std::string_view(bytes).substr(start)), bytes);
}

absl::StatusOr<State> ParseOwn(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(bytes.size(), " bytes"),
                   absl::StrCat("must have at least ", kHeaderBytes + kChecksumBytes));
  }
  std::string_view rest = bytes.substr(0, bytes.size() - kChecksumBytes);
  if (TakeNumber<std::uint32_t>(rest) != kMagic) {
    return Corrupt("another kind of data", "must be a state");
  }
  const auto has_box = TakeVersion(rest, kVersion, kVersionWithBox);
  if (!has_box.ok()) return has_box.status();
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  State state;
  if (const auto cell_size = TakeNumber<double>(rest); cell_size != 0) state.cell_size = cell_size;
  if (const auto spacing = TakeNumber<double>(rest); spacing != 0) state.spacing = spacing;
  state.area_offset = TakeOptional(rest);
  state.history.time = TakeOptional(rest);
  state.history.identities_given = TakeNumber<std::uint64_t>(rest);
  if (*has_box && bytes.size() < kHeaderBytes + kBoxBytes + kChecksumBytes) {
    return Corrupt("a box cut off", kAsWritten);
  }
  if (absl::Status status = TakeBox(*has_box, rest, state.history.box); !status.ok()) return status;
  const auto counts = TakeCounts(kKinds, rest);
  if (!counts.ok()) return counts.status();
  const auto numbers_of = [](auto& item) { return NumbersOf(item); };
  if (!TakeArrays(*counts, numbers_of, rest, ArraysOf(state))) {
    return Corrupt("a ring of another kind", "must be of kind 0 or 1");
  }
  if (absl::Status status = CheckContents(state); !status.ok()) return status;
  return state;
}

// Reads a state with sections, or if `has_surface` the state of a stream of surfaces.
absl::StatusOr<State> ParseStates(std::string_view bytes, bool has_surface) {
  constexpr std::size_t kMostStates = 1 + ReconstructionParameters::kMaxSections;
  if (bytes.size() < kSectionsHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(bytes.size(), " bytes"), kAsWritten);
  }
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  std::string_view rest = bytes.substr(4, bytes.size() - 4 - kChecksumBytes);
  if (absl::Status status = TakeVersion(rest, kVersion); !status.ok()) return status;
  const auto count = TakeNumber<std::uint64_t>(rest);
  const std::uint64_t least = has_surface ? 1 : 2;
  if (count < least || count > kMostStates) {
    return Corrupt(absl::StrCat(count, " states"),
                   absl::StrCat("must be ", least, " to ", kMostStates));
  }
  State state;
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint64_t own = rest.size() < 8 ? ~std::uint64_t{0} : TakeNumber<std::uint64_t>(rest);
    if (own > rest.size()) return Corrupt("states cut off", kAsWritten);
    const std::string_view own_bytes = rest.substr(0, own);
    rest.remove_prefix(own);
    if (k == 0 && has_surface) {
      auto surface = ParseSurfaceState(own_bytes);
      if (!surface.ok()) return surface.status();
      state.surface = *std::move(surface);
      continue;
    }
    auto parsed = ParseOwn(own_bytes);
    if (!parsed.ok()) return parsed;
    if (k == 0) {
      state = *std::move(parsed);
    } else {
      state.sections.push_back(*std::move(parsed));
    }
  }
  if (rest.empty()) return state;
  return Corrupt(absl::StrCat(rest.size(), " bytes too many"), kAsWritten);
}

std::size_t BytesWithoutNoise(const State& state) {
  const bool has_surface = HasSurface(state);
  if (state.sections.empty() && !has_surface) return OwnBytes(state);
  const std::size_t first = has_surface ? SerializedBytes(state.surface) : OwnBytes(state);
  std::size_t bytes = kSectionsHeaderBytes + 8 + first + kChecksumBytes;
  for (const State& section : state.sections) bytes += 8 + OwnBytes(section);
  return bytes;
}

std::string SerializeWithoutNoise(const State& state) {
  std::string bytes;
  bytes.reserve(BytesWithoutNoise(state));
  const bool has_surface = HasSurface(state);
  if (state.sections.empty() && !has_surface) {
    PutOwn(state, bytes);
    return bytes;
  }
  PutNumber(has_surface ? kWithSurfaceMagic : kSectionsMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(std::uint64_t{state.sections.size() + 1}, bytes);
  const auto put = [&](const State& own) {
    PutNumber(std::uint64_t{OwnBytes(own)}, bytes);
    PutOwn(own, bytes);
  };
  if (has_surface) {
    const std::string surface = Serialize(state.surface);
    PutNumber(std::uint64_t{surface.size()}, bytes);
    bytes += surface;
  } else {
    put(state);
  }
  for (const State& section : state.sections) put(section);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes;
}

std::uint32_t MagicOf(std::string_view bytes) {
  return bytes.size() < 4 ? 0 : TakeNumber<std::uint32_t>(bytes);
}

absl::StatusOr<State> ParseWithoutNoise(std::string_view bytes) {
  const std::uint32_t magic = MagicOf(bytes);
  if (magic != kSectionsMagic && magic != kWithSurfaceMagic) return ParseOwn(bytes);
  return ParseStates(bytes, magic == kWithSurfaceMagic);
}

}  // namespace

std::size_t SerializedBytes(const State& state) {
  const std::size_t bytes = BytesWithoutNoise(state);
  return state.noise == NoiseHistory{} ? bytes : SerializedNoiseBytes(state.noise, bytes);
}

std::string Serialize(const State& state) {
  std::string bytes = SerializeWithoutNoise(state);
  if (state.noise != NoiseHistory{}) bytes = SerializeWithNoise(state.noise, bytes);
  return bytes;
}

absl::StatusOr<State> ParseState(std::string_view bytes) {
  if (MagicOf(bytes) != kWithNoiseMagic) return ParseWithoutNoise(bytes);
  NoiseHistory noise;
  const auto rest = TakeNoise(bytes, noise);
  if (!rest.ok()) return rest.status();
  auto state = ParseWithoutNoise(*rest);
  if (state.ok()) state->noise = std::move(noise);
  return state;
}

}  // namespace partiemc
