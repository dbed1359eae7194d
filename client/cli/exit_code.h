// How `partiemc` ends, for scripts.
#pragma once

namespace partiemc::client {

enum ExitCode : int {
  kGood = 0,
  kFailed = 1,        ///< Writing failed, or a check did.
  kUsage = 2,         ///< A flag is wrong.
  kInput = 3,         ///< The input cannot be read, or a frame was refused.
  kServer = 4,        ///< No server, or it ended the stream.
  kInterrupted = 130  ///< Ctrl-C, as shells number it.
};

}  // namespace partiemc::client
