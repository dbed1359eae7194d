// What all readers of client/input are asked.
#pragma once

#include <cstdint>
#include <string_view>

#include "client/input/formats/frame_reader.h"

namespace partiemc::fuzz {

/// The file is all but the first byte, which chooses what is asked of it: which columns and
/// condition, frames to be read or passed over, its format to be recognised first. Opens it with
/// `open`, reads to the end or first error, and requires what FrameReader and ParticleRows promise.
void AttackReader(client::input::OpenReader& open, std::uint8_t choice, std::string_view file);

}  // namespace partiemc::fuzz
