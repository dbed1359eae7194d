#include "state/noise_history.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/internal/byte_string.h"
#include "state/state_bytes.h"

namespace partiemc {
namespace {

constexpr std::uint32_t kNoiseVersion = 1, kNoiseVersionWithBox = 2;
constexpr std::array<ArrayKind, 3> kNoiseKinds = {{{"ids", 8}, {"coordinates", 8}, {"offsets", 4}}};
constexpr std::size_t kNoiseHeaderBytes = 4 + 4 + 8;
constexpr std::size_t kCountBytes = 8 * kNoiseKinds.size();

// Largest offset, in cells. The filter keeps offsets below a spacing, which is at most four cells.
constexpr float kMostOffset = 5;

auto NoiseArraysOf(auto& noise) { return std::tie(noise.ids, noise.given, noise.offsets); }

std::array<std::uint64_t, kNoiseKinds.size()> NoiseCountsOf(const NoiseHistory& noise) {
  return {noise.ids.size(), noise.given.size(), noise.offsets.size()};
}

absl::Status CheckNoise(const NoiseHistory& noise) {
  const std::size_t count = noise.ids.size(), coordinates = noise.given.size();
  const bool fits = count > 0 && (coordinates == 2 * count || coordinates == 3 * count);
  if (!fits || noise.offsets.size() != coordinates) {
    return Corrupt(absl::StrCat(coordinates, " coordinates and ", noise.offsets.size(),
                                " offsets of ", count, " particles"),
                   "must be two or three per particle");
  }
  for (std::size_t k = 1; k < count; ++k) {
    if (noise.ids[k - 1] < noise.ids[k]) continue;
    return Corrupt(absl::StrCat("id ", k), "must be above the one before it");
  }
  for (std::size_t k = 0; k < coordinates; ++k) {
    if (std::isfinite(noise.given[k]) && std::abs(noise.offsets[k]) <= kMostOffset) continue;
    return Corrupt(absl::StrCat("coordinate ", k), "must be finite and have an offset in [-5, 5]");
  }
  return absl::OkStatus();
}

}  // namespace

std::size_t SerializedNoiseBytes(const NoiseHistory& noise, std::size_t state_bytes) {
  return kNoiseHeaderBytes + state_bytes + BoxBytes(noise.box) + kCountBytes +
         BytesOf(kNoiseKinds, NoiseCountsOf(noise)) + kChecksumBytes;
}

std::string SerializeWithNoise(const NoiseHistory& noise, std::string_view state_bytes) {
  std::string bytes;
  bytes.reserve(SerializedNoiseBytes(noise, state_bytes.size()));
  PutNumber(kWithNoiseMagic, bytes);
  PutNumber(noise.box ? kNoiseVersionWithBox : kNoiseVersion, bytes);
  PutNumber(std::uint64_t{state_bytes.size()}, bytes);
  bytes += state_bytes;
  PutBox(noise.box, bytes);
  for (const std::uint64_t count : NoiseCountsOf(noise)) PutNumber(count, bytes);
  PutArrays(
      NoiseArraysOf(noise), [](const auto& number) { return std::tie(number); }, bytes);
  PutNumber(ChecksumOf(bytes), bytes);
  return bytes;
}

absl::StatusOr<std::string_view> TakeNoise(std::string_view bytes, NoiseHistory& noise) {
  if (bytes.size() < kNoiseHeaderBytes + kCountBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(bytes.size(), " bytes"), kAsWritten);
  }
  std::string_view rest = bytes.substr(4, bytes.size() - 4 - kChecksumBytes);
  const auto has_box = TakeVersion(rest, kNoiseVersion, kNoiseVersionWithBox);
  if (!has_box.ok()) return has_box.status();
  if (absl::Status status = CheckSum(bytes); !status.ok()) return status;
  const auto state_bytes = TakeNumber<std::uint64_t>(rest);
  const std::size_t after = kCountBytes + (*has_box ? kBoxBytes : 0);
  if (rest.size() < after || state_bytes > rest.size() - after) {
    return Corrupt("a state cut off", kAsWritten);
  }
  const std::string_view state = rest.substr(0, state_bytes);
  rest.remove_prefix(state_bytes);
  if (absl::Status status = TakeBox(*has_box, rest, noise.box); !status.ok()) return status;
  const auto counts = TakeCounts(kNoiseKinds, rest);
  if (!counts.ok()) return counts.status();
  TakeArrays(
      *counts, [](auto& number) { return std::tie(number); }, rest, NoiseArraysOf(noise));
  if (absl::Status status = CheckNoise(noise); !status.ok()) return status;
  return state;
}

}  // namespace partiemc
