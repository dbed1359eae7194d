// The bytes of a NoiseHistory around the bytes of the rest of the state. Little-endian layout:
// magic, version, the number of bytes of the rest, these bytes, the box in the second version, the
// numbers of ids, coordinates and offsets, these arrays, checksum.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "partiemc/state.h"

namespace partiemc {

inline constexpr std::uint32_t kWithNoiseMagic = 0x4e504d45;  // "EMPN"

/// The size of the result of SerializeWithNoise. `state_bytes`: the size of the rest of the state.
std::size_t SerializedNoiseBytes(const NoiseHistory& noise, std::size_t state_bytes);

std::string SerializeWithNoise(const NoiseHistory& noise, std::string_view state_bytes);

/// Reads and checks the history, except for the magic. Returns the part of `bytes` with the rest of
/// the state, which it does not check. Errors: INVALID_ARGUMENT (CORRUPT_STATE).
absl::StatusOr<std::string_view> TakeNoise(std::string_view bytes, NoiseHistory& noise);

}  // namespace partiemc
