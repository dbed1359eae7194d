// What the command line says, and how it is interrupted.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "cli/exit_code.h"

namespace partiemc::client {

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

/// From here on SIGINT and SIGTERM only set a flag, the second one ends the program at once.
void CatchInterrupts();
bool Interrupted();

}  // namespace partiemc::client
