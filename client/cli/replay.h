// `partiemc replay`: a recorded sequence through a server, or through the core in this process.
#pragma once

#include "CLI/CLI.hpp"
#include "cli/replay_flags.h"

namespace partiemc::client {

/// Adds the verb to `app`; its flags go to `flags`, which must outlive the parsing.
CLI::App* AddReplay(CLI::App& app, ReplayFlags& flags);

/// Returns the exit code.
int Replay(const ReplayFlags& flags);

}  // namespace partiemc::client
