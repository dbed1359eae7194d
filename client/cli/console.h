// What the command line says, how it is interrupted, and how it ends.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

/// How the program ends, for scripts.
enum ExitCode : int {
  kGood = 0,
  kFailed = 1,        ///< Writing failed, or a check did.
  kUsage = 2,         ///< A flag is wrong.
  kInput = 3,         ///< The input cannot be read, or a frame was refused.
  kServer = 4,        ///< No server, or it ended the stream.
  kInterrupted = 130  ///< Ctrl-C, as shells number it.
};

/// Prints "partiemc: MESSAGE" as one line on standard error and returns `code`.
int Complain(ExitCode code, std::string_view message);
int Complain(ExitCode code, const absl::Status& status);

/// One line that a terminal shows and does not obey, whoever the text came from: line breaks become
/// \n, other control characters and what is no UTF-8 escapes (Printable).
std::string OneLine(std::string_view text);
std::string OneLine(const absl::Status& status);

/// A field in a message becomes the flag that a person gave, "address" becomes "--server":
/// "parameters.kernel_radius: 99; ..." -> "--kernel-radius: 99; ...".
std::string AsFlag(const absl::Status& status);

/// Complains of a server that could not be reached, or of the flags that say how, which
/// INVALID_ARGUMENT tells; returns kServer or kUsage.
int ComplainOfServer(const absl::Status& status);

/// The search for a server as a line of progress: "lost HOST:PORT (WHY), trying again: 12 of 300
/// s".
std::string WaitingText(const Reconnecting& reconnecting);

/// After this call the first SIGINT or SIGTERM sets a flag and the second ends the program.
void CatchInterrupts();
bool Interrupted();

}  // namespace partiemc::client
