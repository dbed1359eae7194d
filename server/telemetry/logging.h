// The log: one line per event of the server or of a stream, on standard error. LogWriter writes it
// on its own thread.
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

/// Sets up spdlog's default logger, and sends gRPC's own errors there at level debug. `level` is
/// trace, debug, info, warn, error or off. Requires: gRPC has not started.
void SetUpLogging(const std::string& level, LogFormat format);

/// Removes GRPC_TRACE from the environment and logs this. Every trace of gRPC could print bearer or
/// stream tokens. Requires: SetUpLogging was called, gRPC has not started.
void RefuseTraces();

/// Flushes the log if the process aborts (an assertion, std::terminate).
void FlushLogOnAbort();

/// Logs the number of dropped lines and waits up to `patience` until everything is written.
void FlushLog(std::chrono::milliseconds patience = std::chrono::milliseconds(500));

/// Totals since the start: lines dropped because standard error was too slow, and refusals above
/// the rate of LogRefusal.
struct LogLosses {
  std::uint64_t dropped_lines = 0;
  std::uint64_t refusals_held_back = 0;
};
LogLosses LossesOfLog();

/// A field of an event.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::uint64_t, double> value;
};

/// Logs one event of the server, a stream or a caller. As text: `stream opened id=7 name="two
/// words"`; as JSON: {"time":...,"level":"info","message":"stream opened","id":7,"name":"two
/// words"}. Values may come from clients: line breaks and control characters are escaped.
void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields);

/// Logs a refused caller or request with its reason. Writes at most twenty lines per second, then
/// one line with the number of further refusals.
void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status);

/// The formatter of log lines, for other sinks.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace partiemc::server
