// Common checks of all readers of client/input.
#pragma once

#include <cstdint>
#include <string_view>

#include "client/input/formats/frame_reader.h"

namespace partiemc::fuzz {

/// The first byte chooses columns, condition, whether frames are read or skipped, and whether the
/// format is detected first; the rest is the file. Opens it with `open`, reads to the end or the
/// first error, and requires the contracts of FrameReader and ParticleRows.
void AttackReader(client::input::OpenReader& open, std::uint8_t choice, std::string_view file);

}  // namespace partiemc::fuzz
