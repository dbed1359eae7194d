// The log: one line per event of the server or of a stream, to standard error. Nobody waits for it:
// a thread of its own writes (LogWriter).
#pragma once

#include <spdlog/common.h>
#include <spdlog/formatter.h>

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "absl/status/status.h"

namespace partiemc::server {

enum class LogFormat { kText, kJson };

/// Sets up spdlog's default logger, and has gRPC's own errors go there at level debug, nothing else
/// of what it says. `level` is one of trace, debug, info, warn, error, off. Called before gRPC
/// starts.
void SetUpLogging(const std::string& level, LogFormat format);

/// Takes GRPC_TRACE out of the environment, and tells in the log that it did. gRPC's traces print
/// what travels, bearer and stream tokens among it, in words and in bytes, so that no choice of
/// them would be safe. After SetUpLogging, before gRPC starts.
void RefuseTraces();

/// When the process aborts (an assertion, std::terminate), what was logged before is written first.
void FlushLogOnAbort();

/// Tells what was left out, and waits until all is written, for `patience` at most.
void FlushLog(std::chrono::milliseconds patience = std::chrono::milliseconds(500));

/// Since the start: lines without room because standard error was too slow, and refusals above the
/// rate of LogRefusal.
struct LogLosses {
  std::uint64_t dropped_lines = 0;
  std::uint64_t refusals_held_back = 0;
};
LogLosses LossesOfLog();

/// What is known about an event, beside its name.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::uint64_t, double> value;
};

/// One line for something that has happened to the server, a stream or a caller. As text:
/// `stream opened id=7 name="two words"`; as JSON the fields stand beside the message:
/// {"time":...,"level":"info","message":"stream opened","id":7,"name":"two words"}. Values may come
/// from clients: what would break a line, or what a terminal would obey, is escaped.
void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields);

/// A caller that was not let in, or what it asked for was not: who, and why. Twenty lines a second
/// at most, so that a flood of refusals is none of lines; then one tells how many more there were.
void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status);

/// What gives a line its format, for a sink of one's own.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace partiemc::server
