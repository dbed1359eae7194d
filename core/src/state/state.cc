#include "partiemc/state.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "partiemc/parameters.h"
#include "partiemc/status.h"
#include "state/state_parts.h"

namespace partiemc {
namespace {

// Layout, little-endian: magic, version, cell size, spacing (0: none), area offset, time (kAbsent:
// none), identities given, a count of each of kKinds, then these, checksum.
//
// With sections there are several states: another magic, version, their number, then of each, the
// stream's own first, the number of its bytes and these; checksum.
constexpr std::uint32_t kMagic = 0x53504d45;          // "EMPS"
constexpr std::uint32_t kSectionsMagic = 0x4d504d45;  // "EMPM"
constexpr std::uint32_t kVersion = 5;
constexpr std::uint64_t kAbsent = 0x7ff8000000000000;  // Not a number.
constexpr std::size_t kNormalBytes = 4 + 4 + 4 + 4;
constexpr std::size_t kChecksumBytes = 8;

// What there may be any number of, in the order in which it is written.
struct Kind {
  const char* name;
  std::size_t bytes;
};
constexpr std::array<Kind, 4> kKinds = {{{"normals", kNormalBytes},
                                         {"rings", kRingBytes},
                                         {"runs", kRunBytes},
                                         {"samples", kSampleBytes}}};
using Counts = std::array<std::uint64_t, kKinds.size()>;

constexpr std::size_t kHeaderBytes = 4 + 4 + 5 * 8 + 8 * kKinds.size();
constexpr std::size_t kSectionsHeaderBytes = 4 + 4 + 8;

bool IsLength(double value) { return value >= 1e-62 && value <= 1e62; }

absl::Status CheckNormals(const std::vector<CellNormal>& normals) {
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const CellNormal& normal = normals[k];
    const float square = normal.x * normal.x + normal.y * normal.y;
    if (!(square > 0.99f && square < 1.01f)) {
      return CorruptState(absl::StrCat("normal ", k), "must have unit length");
    }
    if (k > 0 && std::tie(normals[k - 1].row, normals[k - 1].column) >=
                     std::tie(normal.row, normal.column)) {
      return CorruptState(absl::StrCat("normal ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

std::optional<double> TakeOptional(std::string_view& rest) {
  const auto bits = TakeNumber<std::uint64_t>(rest);
  if (bits == kAbsent) return std::nullopt;
  return std::bit_cast<double>(bits);
}

void PutOptional(std::optional<double> value, std::string& bytes) {
  PutNumber(value ? std::bit_cast<std::uint64_t>(*value) : kAbsent, bytes);
}

absl::Status CheckAreaOffset(std::optional<double> offset) {
  if (!offset || (*offset >= -1 && *offset <= 1)) return absl::OkStatus();
  return CorruptState(absl::StrCat("area offset ", ShortestNumber(*offset)),
                      "must be absent or in [-1, 1] spacings");
}

Counts CountsOf(const State& state) {
  const RingHistory& history = state.history;
  return {state.normals.size(), history.rings.size(), history.runs.size(), history.samples.size()};
}

std::uint64_t BytesOf(const Counts& counts) {
  std::uint64_t bytes = 0;
  for (std::size_t k = 0; k < kKinds.size(); ++k) bytes += counts[k] * kKinds[k].bytes;
  return bytes;
}

// Of all bytes before the last ones, which it is. Requires: there are so many.
absl::Status CheckSum(std::string_view bytes) {
  const std::string_view body = bytes.substr(0, bytes.size() - kChecksumBytes);
  std::string_view tail = bytes.substr(body.size());
  if (TakeNumber<std::uint64_t>(tail) == ChecksumOf(body)) return absl::OkStatus();
  return CorruptState("a wrong checksum", "must be what Serialize wrote");
}

// Takes the counts of what fills the bytes after them. Each is bounded before it is multiplied.
absl::StatusOr<Counts> TakeCounts(std::string_view& rest) {
  Counts counts;
  for (std::uint64_t& count : counts) count = TakeNumber<std::uint64_t>(rest);
  bool possible = true;
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    possible = possible && counts[k] <= rest.size() / kKinds[k].bytes;
  }
  if (possible && BytesOf(counts) == rest.size()) return counts;
  std::string told = absl::StrCat(rest.size(), " bytes"), rule = "must be made of";
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    absl::StrAppend(&told, k == 0 ? " for " : ", ", counts[k], " ", kKinds[k].name);
    absl::StrAppend(&rule, k == 0 ? " " : ", ", kKinds[k].name, " of ", kKinds[k].bytes);
  }
  return CorruptState(std::move(told), absl::StrCat(rule, " bytes"));
}

absl::Status TakeNormals(std::string_view& rest, std::vector<CellNormal>& normals) {
  for (CellNormal& normal : normals) {
    normal.column = TakeNumber<std::int32_t>(rest);
    normal.row = TakeNumber<std::int32_t>(rest);
    normal.x = TakeNumber<float>(rest);
    normal.y = TakeNumber<float>(rest);
  }
  return CheckNormals(normals);
}

}  // namespace

absl::Status CorruptState(std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state", std::move(value), std::move(rule)});
}

namespace {

std::size_t OwnBytes(const State& state) {
  return kHeaderBytes + BytesOf(CountsOf(state)) + kChecksumBytes;
}

// Without its sections.
void PutOwn(const State& state, std::string& bytes) {
  const std::size_t start = bytes.size();
  const RingHistory& history = state.history;
  const Counts counts = CountsOf(state);
  PutNumber(kMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(state.cell_size.value_or(0), bytes);
  PutNumber(state.spacing.value_or(0), bytes);
  PutOptional(state.area_offset, bytes);
  PutOptional(history.time, bytes);
  PutNumber(history.identities_given, bytes);
  for (const std::uint64_t count : counts) PutNumber(count, bytes);
  for (const CellNormal& normal : state.normals) {
    PutNumber(normal.column, bytes);
    PutNumber(normal.row, bytes);
    PutNumber(normal.x, bytes);
    PutNumber(normal.y, bytes);
  }
  PutHistory(history, bytes);
  PutNumber(ChecksumOf(std::string_view(bytes).substr(start)), bytes);
}

absl::StatusOr<State> ParseOwn(std::string_view bytes) {
  const std::size_t size = bytes.size();
  if (size < kHeaderBytes + kChecksumBytes) {
    return CorruptState(absl::StrCat(size, " bytes"),
                        absl::StrCat("must have at least ", kHeaderBytes + kChecksumBytes));
  }
  const std::string_view body = bytes.substr(0, size - kChecksumBytes);
  std::string_view rest = body;
  if (TakeNumber<std::uint32_t>(rest) != kMagic) {
    return CorruptState("another kind of data", "must be a state");
  }
  if (const auto version = TakeNumber<std::uint32_t>(rest); version != kVersion) {
    return CorruptState(absl::StrCat("version ", version),
                        absl::StrCat("must be version ", kVersion));
  }
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  State state;
  if (const auto cell_size = TakeNumber<double>(rest); cell_size != 0) state.cell_size = cell_size;
  if (const auto spacing = TakeNumber<double>(rest); spacing != 0) state.spacing = spacing;
  if (state.cell_size.has_value() != state.spacing.has_value() ||
      !IsLength(state.cell_size.value_or(1)) || !IsLength(state.spacing.value_or(1))) {
    return CorruptState(absl::StrCat("cell size ", ShortestNumber(state.cell_size.value_or(0)),
                                     ", spacing ", ShortestNumber(state.spacing.value_or(0))),
                        "must both be absent or both be lengths");
  }
  state.area_offset = TakeOptional(rest);
  if (absl::Status status = CheckAreaOffset(state.area_offset); !status.ok()) return status;
  state.history.time = TakeOptional(rest);
  state.history.identities_given = TakeNumber<std::uint64_t>(rest);
  const auto counts = TakeCounts(rest);
  if (!counts.ok()) return counts.status();
  const auto& [normals, rings, runs, samples] = *counts;
  state.normals.resize(normals);
  state.history.rings.resize(rings);
  state.history.runs.resize(runs);
  state.history.samples.resize(samples);
  if (absl::Status status = TakeNormals(rest, state.normals); !status.ok()) return status;
  if (absl::Status status = TakeHistory(rest, state.history); !status.ok()) return status;
  return state;
}

absl::StatusOr<State> ParseWithSections(std::string_view bytes) {
  const std::size_t size = bytes.size();
  if (size < kSectionsHeaderBytes + kChecksumBytes) {
    return CorruptState(absl::StrCat(size, " bytes"), "must be what Serialize wrote");
  }
  const std::string_view body = bytes.substr(0, size - kChecksumBytes);
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  std::string_view rest = body.substr(4);
  if (const auto version = TakeNumber<std::uint32_t>(rest); version != kVersion) {
    return CorruptState(absl::StrCat("version ", version),
                        absl::StrCat("must be version ", kVersion));
  }
  const auto count = TakeNumber<std::uint64_t>(rest);
  if (count < 2 || count > 1 + ReconstructionParameters::kMaxSections) {
    return CorruptState(absl::StrCat(count, " states"),
                        absl::StrCat("must be 2 to ", 1 + ReconstructionParameters::kMaxSections));
  }
  State state;
  for (std::uint64_t k = 0; k < count; ++k) {
    if (rest.size() < 8) return CorruptState("states cut off", "must be what Serialize wrote");
    const auto own = TakeNumber<std::uint64_t>(rest);
    if (own > rest.size()) return CorruptState("states cut off", "must be what Serialize wrote");
    auto parsed = ParseOwn(rest.substr(0, own));
    if (!parsed.ok()) return parsed;
    rest.remove_prefix(own);
    if (k == 0) {
      state = *std::move(parsed);
    } else {
      state.sections.push_back(*std::move(parsed));
    }
  }
  if (!rest.empty()) {
    return CorruptState(absl::StrCat(rest.size(), " bytes too many"),
                        "must be what Serialize wrote");
  }
  return state;
}

}  // namespace

std::size_t SerializedBytes(const State& state) {
  if (state.sections.empty()) return OwnBytes(state);
  std::size_t bytes = kSectionsHeaderBytes + 8 + OwnBytes(state) + kChecksumBytes;
  for (const State& section : state.sections) bytes += 8 + OwnBytes(section);
  return bytes;
}

std::string Serialize(const State& state) {
  std::string bytes;
  bytes.reserve(SerializedBytes(state));
  if (state.sections.empty()) {
    PutOwn(state, bytes);
    return bytes;
  }
  PutNumber(kSectionsMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(std::uint64_t{state.sections.size() + 1}, bytes);
  const auto put = [&](const State& own) {
    PutNumber(std::uint64_t{OwnBytes(own)}, bytes);
    PutOwn(own, bytes);
  };
  put(state);
  for (const State& section : state.sections) put(section);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes;
}

absl::StatusOr<State> ParseState(std::string_view bytes) {
  std::string_view rest = bytes;
  const bool has_sections = rest.size() >= 4 && TakeNumber<std::uint32_t>(rest) == kSectionsMagic;
  return has_sections ? ParseWithSections(bytes) : ParseOwn(bytes);
}

}  // namespace partiemc
