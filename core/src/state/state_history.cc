#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "partiemc/status.h"
#include "state/state_parts.h"

namespace partiemc {
namespace {

constexpr std::uint64_t kMaxIdentities = std::uint64_t{1} << 62;  // No stream gets to the end.

absl::Status CheckRings(const RingHistory& history) {
  for (std::size_t k = 0; k < history.rings.size(); ++k) {
    const KnownRing& ring = history.rings[k];
    const std::uint64_t after = k == 0 ? 0 : history.rings[k - 1].identity;
    if (ring.identity <= after || ring.identity > history.identities_given) {
      return CorruptState(
          absl::StrCat("identity ", ring.identity),
          absl::StrCat("must be above ", after, " and at most ", history.identities_given));
    }
    if (ring.outer != kNoRing && (!ring.is_hole || ring.outer >= history.rings.size() ||
                                  history.rings[ring.outer].is_hole)) {
      return CorruptState(absl::StrCat("ring ", k, " in ring ", ring.outer),
                          "must be a hole in an outer ring, or stand alone");
    }
    if (!std::isfinite(ring.velocity_x) || !std::isfinite(ring.velocity_y)) {
      return CorruptState(absl::StrCat("velocity of ring ", k), "must be finite");
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
      return CorruptState(
          absl::StrCat("sample ", k),
          absl::StrCat("must be one of at most ", kMaxSamples, " of an outer ring"));
    }
    if (k > 0 && history.samples[k - 1].hash >= sample.hash) {
      return CorruptState(absl::StrCat("sample ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

absl::Status CheckHistory(const RingHistory& history) {
  if (history.identities_given > kMaxIdentities) {
    return CorruptState(absl::StrCat(history.identities_given, " identities"),
                        absl::StrCat("must be at most ", kMaxIdentities));
  }
  if (history.time && !std::isfinite(*history.time)) {
    return CorruptState(absl::StrCat("time ", ShortestNumber(*history.time)),
                        "must be absent or finite");
  }
  if (absl::Status status = CheckRings(history); !status.ok()) return status;
  for (std::size_t k = 0; k < history.runs.size(); ++k) {
    const NodeRun& run = history.runs[k];
    if (run.first > run.last || run.ring >= history.rings.size()) {
      return CorruptState(absl::StrCat("run ", k), "must have nodes and a ring");
    }
    if (k > 0 && std::tie(history.runs[k - 1].row, history.runs[k - 1].last) >=
                     std::tie(run.row, run.first)) {
      return CorruptState(absl::StrCat("run ", k), "must come after the one before it");
    }
  }
  return CheckSamples(history);
}

}  // namespace

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

absl::Status TakeHistory(std::string_view& rest, RingHistory& history) {
  for (KnownRing& ring : history.rings) {
    ring.identity = TakeNumber<std::uint64_t>(rest);
    const auto kind = TakeNumber<std::uint32_t>(rest);
    if (kind > 1)
      return CorruptState(absl::StrCat("ring of kind ", kind), "must be of kind 0 or 1");
    ring.is_hole = kind == 1;
    ring.outer = TakeNumber<std::uint32_t>(rest);
    ring.velocity_x = TakeNumber<double>(rest);
    ring.velocity_y = TakeNumber<double>(rest);
  }
  for (NodeRun& run : history.runs) {
    run.row = TakeNumber<std::int32_t>(rest);
    run.first = TakeNumber<std::int32_t>(rest);
    run.last = TakeNumber<std::int32_t>(rest);
    run.ring = TakeNumber<std::uint32_t>(rest);
  }
  for (ParticleSample& sample : history.samples) {
    sample.hash = TakeNumber<std::uint64_t>(rest);
    sample.column = TakeNumber<std::int32_t>(rest);
    sample.row = TakeNumber<std::int32_t>(rest);
    sample.ring = TakeNumber<std::uint32_t>(rest);
  }
  return CheckHistory(history);
}

}  // namespace partiemc
