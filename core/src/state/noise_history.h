// The bytes of a NoiseHistory around the bytes of the other state. Little-endian layout: magic,
// version, the number of bytes of the other state, these bytes, the box in the second version, the
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

/// The size of the result of SerializeWithNoise. `state_bytes`: the size of the other state.
std::size_t SerializedNoiseBytes(const NoiseHistory& noise, std::size_t state_bytes);

std::string SerializeWithNoise(const NoiseHistory& noise, std::string_view state_bytes);

/// Reads and checks the history, and returns the bytes of the other state, which are not checked.
/// Errors: INVALID_ARGUMENT (reason CORRUPT_STATE).
absl::StatusOr<std::string_view> TakeNoise(std::string_view bytes, NoiseHistory& noise);

}  // namespace partiemc
