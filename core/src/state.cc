#include "partiemc/state.h"

#include <bit>
#include <cmath>
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "partiemc/byte_string.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Layout, little-endian: magic, version, cell size, spacing (0: none), area offset, time (kAbsent:
// none), identities given, counts of normals, rings, runs and samples, then these, checksum.
constexpr std::uint32_t kMagic = 0x53504d45;  // "EMPS"
constexpr std::uint32_t kVersion = 3;
constexpr std::size_t kHeaderBytes = 4 + 4 + 5 * 8 + 4 * 8;
constexpr std::uint64_t kAbsent = 0x7ff8000000000000;             // Not a number.
constexpr std::uint64_t kMaxIdentities = std::uint64_t{1} << 62;  // No stream gets to the end.
constexpr std::size_t kNormalBytes = 4 + 4 + 4 + 4;
constexpr std::size_t kRingBytes = 8 + 4 + 4 + 8 + 8;
constexpr std::size_t kRunBytes = 4 + 4 + 4 + 4;
constexpr std::size_t kSampleBytes = 8 + 4 + 4 + 4;
constexpr std::size_t kChecksumBytes = 8;

absl::Status Corrupt(std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state", std::move(value), std::move(rule)});
}

bool IsLength(double value) { return value >= 1e-62 && value <= 1e62; }

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
  return Corrupt(absl::StrCat("area offset ", ShortestNumber(*offset)),
                 "must be absent or in [-1, 1] spacings");
}

absl::Status CheckRings(const RingHistory& history) {
  for (std::size_t k = 0; k < history.rings.size(); ++k) {
    const KnownRing& ring = history.rings[k];
    const std::uint64_t after = k == 0 ? 0 : history.rings[k - 1].identity;
    if (ring.identity <= after || ring.identity > history.identities_given) {
      return Corrupt(
          absl::StrCat("identity ", ring.identity),
          absl::StrCat("must be above ", after, " and at most ", history.identities_given));
    }
    if (ring.outer != kNoRing && (!ring.is_hole || ring.outer >= history.rings.size() ||
                                  history.rings[ring.outer].is_hole)) {
      return Corrupt(absl::StrCat("ring ", k, " in ring ", ring.outer),
                     "must be a hole in an outer ring, or stand alone");
    }
    if (!std::isfinite(ring.velocity_x) || !std::isfinite(ring.velocity_y)) {
      return Corrupt(absl::StrCat("velocity of ring ", k), "must be finite");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckSamples(const RingHistory& history) {
  std::vector<std::uint32_t> count(history.rings.size());
  for (std::size_t k = 0; k < history.samples.size(); ++k) {
    const ParticleSample& sample = history.samples[k];
    if (sample.ring >= history.rings.size() || history.rings[sample.ring].is_hole ||
        ++count[sample.ring] > kMaxSamples) {
      return Corrupt(absl::StrCat("sample ", k),
                     absl::StrCat("must be one of at most ", kMaxSamples, " of an outer ring"));
    }
    if (k > 0 && history.samples[k - 1].hash >= sample.hash) {
      return Corrupt(absl::StrCat("sample ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckHistory(const RingHistory& history) {
  if (history.identities_given > kMaxIdentities) {
    return Corrupt(absl::StrCat(history.identities_given, " identities"),
                   absl::StrCat("must be at most ", kMaxIdentities));
  }
  if (history.time && !std::isfinite(*history.time)) {
    return Corrupt(absl::StrCat("time ", ShortestNumber(*history.time)),
                   "must be absent or finite");
  }
  if (absl::Status status = CheckRings(history); !status.ok()) return status;
  for (std::size_t k = 0; k < history.runs.size(); ++k) {
    const NodeRun& run = history.runs[k];
    if (run.first > run.last || run.ring >= history.rings.size()) {
      return Corrupt(absl::StrCat("run ", k), "must have nodes and a ring");
    }
    if (k > 0 && std::tie(history.runs[k - 1].row, history.runs[k - 1].last) >=
                     std::tie(run.row, run.first)) {
      return Corrupt(absl::StrCat("run ", k), "must come after the one before it");
    }
  }
  return CheckSamples(history);
}

struct Counts {
  std::uint64_t normals, rings, runs, samples;
};

// Whether `bytes` is what so many elements take. Each count is bounded before it is multiplied.
bool Fill(const Counts& counts, std::size_t bytes) {
  return counts.normals <= bytes / kNormalBytes && counts.rings <= bytes / kRingBytes &&
         counts.runs <= bytes / kRunBytes && counts.samples <= bytes / kSampleBytes &&
         counts.normals * kNormalBytes + counts.rings * kRingBytes + counts.runs * kRunBytes +
                 counts.samples * kSampleBytes ==
             bytes;
}

void PutHistory(const RingHistory& history, std::string& bytes) {
  for (const KnownRing& ring : history.rings) {
    PutNumber(ring.identity, bytes);
    PutNumber(std::uint32_t{ring.is_hole}, bytes);
    PutNumber(ring.outer, bytes);
    PutNumber(ring.velocity_x, bytes);
    PutNumber(ring.velocity_y, bytes);
  }
  for (const NodeRun& run : history.runs) {
    PutNumber(run.row, bytes);
    PutNumber(run.first, bytes);
    PutNumber(run.last, bytes);
    PutNumber(run.ring, bytes);
  }
  for (const ParticleSample& sample : history.samples) {
    PutNumber(sample.hash, bytes);
    PutNumber(sample.column, bytes);
    PutNumber(sample.row, bytes);
    PutNumber(sample.ring, bytes);
  }
}

absl::Status TakeHistory(const Counts& counts, std::string_view& rest, RingHistory& history) {
  history.rings.resize(counts.rings);
  for (KnownRing& ring : history.rings) {
    ring.identity = TakeNumber<std::uint64_t>(rest);
    const auto kind = TakeNumber<std::uint32_t>(rest);
    if (kind > 1) return Corrupt(absl::StrCat("ring of kind ", kind), "must be of kind 0 or 1");
    ring.is_hole = kind == 1;
    ring.outer = TakeNumber<std::uint32_t>(rest);
    ring.velocity_x = TakeNumber<double>(rest);
    ring.velocity_y = TakeNumber<double>(rest);
  }
  history.runs.resize(counts.runs);
  for (NodeRun& run : history.runs) {
    run.row = TakeNumber<std::int32_t>(rest);
    run.first = TakeNumber<std::int32_t>(rest);
    run.last = TakeNumber<std::int32_t>(rest);
    run.ring = TakeNumber<std::uint32_t>(rest);
  }
  history.samples.resize(counts.samples);
  for (ParticleSample& sample : history.samples) {
    sample.hash = TakeNumber<std::uint64_t>(rest);
    sample.column = TakeNumber<std::int32_t>(rest);
    sample.row = TakeNumber<std::int32_t>(rest);
    sample.ring = TakeNumber<std::uint32_t>(rest);
  }
  return CheckHistory(history);
}

}  // namespace

std::string Serialize(const State& state) {
  std::string bytes;
  const RingHistory& history = state.history;
  bytes.reserve(kHeaderBytes + kNormalBytes * state.normals.size() +
                kRingBytes * history.rings.size() + kRunBytes * history.runs.size() +
                kSampleBytes * history.samples.size() + kChecksumBytes);
  PutNumber(kMagic, bytes);
  PutNumber(kVersion, bytes);
  PutNumber(state.cell_size.value_or(0), bytes);
  PutNumber(state.spacing.value_or(0), bytes);
  PutOptional(state.area_offset, bytes);
  PutOptional(history.time, bytes);
  PutNumber(history.identities_given, bytes);
  PutNumber(static_cast<std::uint64_t>(state.normals.size()), bytes);
  PutNumber(static_cast<std::uint64_t>(history.rings.size()), bytes);
  PutNumber(static_cast<std::uint64_t>(history.runs.size()), bytes);
  PutNumber(static_cast<std::uint64_t>(history.samples.size()), bytes);
  for (const CellNormal& normal : state.normals) {
    PutNumber(normal.column, bytes);
    PutNumber(normal.row, bytes);
    PutNumber(normal.x, bytes);
    PutNumber(normal.y, bytes);
  }
  PutHistory(history, bytes);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes;
}

absl::StatusOr<State> ParseState(std::string_view bytes) {
  const std::size_t size = bytes.size();
  if (size < kHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(size, " bytes"),
                   absl::StrCat("must have at least ", kHeaderBytes + kChecksumBytes));
  }
  std::string_view tail = bytes.substr(size - kChecksumBytes);
  const std::string_view body = bytes.substr(0, size - kChecksumBytes);
  std::string_view rest = body;
  if (TakeNumber<std::uint32_t>(rest) != kMagic) {
    return Corrupt("another kind of data", "must be a state");
  }
  if (const auto version = TakeNumber<std::uint32_t>(rest); version != kVersion) {
    return Corrupt(absl::StrCat("version ", version), absl::StrCat("must be version ", kVersion));
  }
  if (TakeNumber<std::uint64_t>(tail) != ChecksumOf(body)) {
    return Corrupt("a wrong checksum", "must be what Serialize wrote");
  }
  State state;
  if (const auto cell_size = TakeNumber<double>(rest); cell_size != 0) state.cell_size = cell_size;
  if (const auto spacing = TakeNumber<double>(rest); spacing != 0) state.spacing = spacing;
  if (state.cell_size.has_value() != state.spacing.has_value() ||
      !IsLength(state.cell_size.value_or(1)) || !IsLength(state.spacing.value_or(1))) {
    return Corrupt(absl::StrCat("cell size ", ShortestNumber(state.cell_size.value_or(0)),
                                ", spacing ", ShortestNumber(state.spacing.value_or(0))),
                   "must both be absent or both be lengths");
  }
  state.area_offset = TakeOptional(rest);
  if (absl::Status status = CheckAreaOffset(state.area_offset); !status.ok()) return status;
  state.history.time = TakeOptional(rest);
  state.history.identities_given = TakeNumber<std::uint64_t>(rest);
  Counts counts{};
  counts.normals = TakeNumber<std::uint64_t>(rest);
  counts.rings = TakeNumber<std::uint64_t>(rest);
  counts.runs = TakeNumber<std::uint64_t>(rest);
  counts.samples = TakeNumber<std::uint64_t>(rest);
  if (!Fill(counts, rest.size())) {
    return Corrupt(
        absl::StrCat(counts.normals, " normals, ", counts.rings, " rings, ", counts.runs,
                     " runs and ", counts.samples, " samples in ", rest.size(), " bytes"),
        absl::StrCat("must be ", kNormalBytes, ", ", kRingBytes, ", ", kRunBytes, " and ",
                     kSampleBytes, " bytes each"));
  }
  state.normals.resize(counts.normals);
  for (CellNormal& normal : state.normals) {
    normal.column = TakeNumber<std::int32_t>(rest);
    normal.row = TakeNumber<std::int32_t>(rest);
    normal.x = TakeNumber<float>(rest);
    normal.y = TakeNumber<float>(rest);
  }
  if (absl::Status status = CheckNormals(state.normals); !status.ok()) return status;
  if (absl::Status status = TakeHistory(counts, rest, state.history); !status.ok()) return status;
  return state;
}

}  // namespace partiemc
