// The log: one line on standard error for each event of the server or of a stream. LogWriter writes
// the lines on its own thread.
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

/// Sets up spdlog's default logger, and sends gRPC's own errors to it at level debug. `level` is
/// trace, debug, info, warn, error or off. Requires: gRPC has not started.
void SetUpLogging(const std::string& level, LogFormat format);

/// Removes GRPC_TRACE from the environment and logs the removal, because gRPC's traces could print
/// bearer tokens or stream tokens. Requires: SetUpLogging was called, gRPC has not started.
void RefuseTraces();

/// Installs a handler that flushes the log if the process aborts (an assertion, std::terminate).
void FlushLogOnAbort();

/// Logs the losses (LogLosses) since they were last logged. Then waits at most `patience` until all
/// lines are written.
void FlushLog(std::chrono::milliseconds patience = std::chrono::milliseconds(500));

/// Losses since the start: lines that were dropped because standard error was too slow, and
/// refusals and calls that LogRefusal and LogCall did not log because of their rate limits.
struct LogLosses {
  std::uint64_t dropped_lines = 0;
  std::uint64_t refusals_held_back = 0;
  std::uint64_t calls_held_back = 0;
};
LogLosses LossesOfLog();

/// A field of an event.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::uint64_t, double> value;
};

/// Logs one event of the server, of a stream or of a caller. Text format: `stream opened id=7
/// name="two words"`. JSON format: `{"time":...,"level":"info","message":"stream
/// opened","id":7,"name":"two words"}`. Values may come from clients, so line breaks and control
/// characters are escaped.
void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields);

/// Logs a refused caller or request with its reason. `client`: the name of the caller; empty if it
/// is unknown. Writes at most twenty lines per second; then writes one line with the number of
/// refusals that were not logged.
void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status,
                const std::string& client = {});

/// Logs the begin or the end of an admitted call. Writes at most 500 lines per second; then writes
/// one line with the number of lines that were not written.
void LogCall(std::string_view event, std::initializer_list<LogField> fields);

/// Creates the formatter of log lines, for other sinks of spdlog.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace partiemc::server
