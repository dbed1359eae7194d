// Streams in parts over several connections, in an order chosen by a test or a fuzzer. Compares the
// server's machines with a reference that only stores which parts were sent.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "server/scripted_transport.h"

namespace partiemc::server {

/// Returns a number below `count`.
using ChooseBelow = std::function<std::size_t(std::size_t count)>;

/// Runs `steps` events: messages, received answers, pauses, lost connections, lost streams. Then
/// each stream in turn sends the rest of its frames and ends, while the next ones are silent.
/// Returns the violated promise, or an empty string:
/// - held and planned memory never exceeds the budget and the slots beyond it;
/// - each frame of part 0 and each part is answered once while its connection lives;
/// - a frame is computed if and only if it has all parts;
/// - no connection waits forever;
/// - at the end nothing is held, planned or waiting.
std::string RunPartsModel(SteppedPool& pool, const ChooseBelow& choose, std::size_t steps);

}  // namespace partiemc::server
