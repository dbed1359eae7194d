// `partiemc replay`: a recorded sequence through a server, or through the core in this process.
#pragma once

#include "client/cli/replay_flags.h"

namespace partiemc::client {

/// Returns the exit code.
int Replay(const ReplayFlags& flags);

}  // namespace partiemc::client
