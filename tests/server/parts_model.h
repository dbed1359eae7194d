// Streams whose frames come in parts over several connections, in an order that a test or a fuzzer
// chooses: the server's machines against a reference that only remembers which parts were sent.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "server/scripted_transport.h"

namespace partiemc::server {

/// Chooses a number below `count`.
using ChooseBelow = std::function<std::size_t(std::size_t count)>;

/// Runs `steps` events: messages, answers that are taken, pauses, lost connections, lost streams.
/// Then stream after stream sends the rest of its frames and ends, while the next ones are silent.
/// Returns the promise that was broken, or nothing:
///  - what is held or planned never exceeds the budget and the slots beyond it;
///  - each frame of part 0 and each part is answered once, while its connection lives;
///  - a frame is computed if and only if all of its parts are there;
///  - no connection waits for ever;
///  - nothing is held, planned, or waits at the end.
std::string RunPartsModel(SteppedPool& pool, const ChooseBelow& choose, std::size_t steps);

}  // namespace partiemc::server
