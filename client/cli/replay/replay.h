// `partiemc replay`: sends a recorded sequence to a server, or reconstructs it in this process.
#pragma once

#include "client/cli/replay_flags.h"

namespace partiemc::client {

/// Returns the exit code.
int Replay(const ReplayFlags& flags);

}  // namespace partiemc::client
