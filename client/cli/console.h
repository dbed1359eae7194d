// Messages, exit codes and signals of the command line.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

/// Exit codes, for scripts.
enum ExitCode : int {
  kGood = 0,
  kFailed = 1,        ///< An output could not be written, or a check failed.
  kUsage = 2,         ///< A flag is wrong.
  kInput = 3,         ///< The input cannot be read, or a frame was refused.
  kServer = 4,        ///< No server, or it ended the stream.
  kInterrupted = 130  ///< SIGINT or SIGTERM; shells use this number for SIGINT.
};

/// Prints "partiemc: MESSAGE" as one line on standard error and returns `code`.
int Complain(ExitCode code, std::string_view message);
int Complain(ExitCode code, const absl::Status& status);

/// Flushes standard output and returns `code`. If standard output could not be written and `code`
/// is kGood, prints a message and returns kFailed.
int EndOutput(int code);

/// Makes untrusted text safe to print on one line of a terminal. Line feeds become "\n"; carriage
/// returns and tabs become blanks; other control characters and invalid UTF-8 become escapes
/// (Printable).
std::string OneLine(std::string_view text);
std::string OneLine(const absl::Status& status);

/// Replaces the field at the start of a message by its flag: "address: ..." -> "--server: ...",
/// "parameters.kernel_radius: 99; ..." -> "--kernel-radius: 99; ...",
/// "parameters.walls[1].points: ..." -> "--wall number 2: ...".
std::string AsFlag(const absl::Status& status);

/// Prints why a server could not be reached. Returns kUsage for INVALID_ARGUMENT, which means a
/// wrong flag, and kServer for every other status.
int ComplainOfServer(const absl::Status& status);

/// Returns a line of progress that describes a reconnection: "lost HOST:PORT (WHY), trying again:
/// 12 of 300 s".
std::string WaitingText(const Reconnecting& reconnecting);

/// After this call SIGINT and SIGTERM set a flag, which Interrupted returns. The second signal of
/// the same kind ends the program.
void CatchInterrupts();
bool Interrupted();

}  // namespace partiemc::client
