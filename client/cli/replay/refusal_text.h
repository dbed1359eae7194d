// Texts for users about refused frames.
#pragma once

#include <span>
#include <string>

#include "client/input/sequence.h"

namespace partiemc::client {

/// The message of a refused frame, with columns of the input in place of the core's arrays:
/// "volumes[17]: 0; must be ..." becomes "volume of particle 17 (counted from 0) at (1, 2), by
/// column 'radius': 0; must be ...". `attributes`: names of the attributes, in the order in which
/// they were sent.
std::string RefusalText(const RecordedFrame& frame, std::span<const std::string> attributes,
                        const std::string& message);

}  // namespace partiemc::client
