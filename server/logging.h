// The log: one line per event of the server or of a stream, to standard error.
#pragma once

#include <spdlog/common.h>
#include <spdlog/formatter.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "absl/status/status.h"

namespace partiemc::server {

enum class LogFormat { kText, kJson };

/// Sets up spdlog's default logger, and has gRPC's own messages go there at level debug.
/// `level` is one of trace, debug, info, warn, error, off. Called once, before threads start.
void SetUpLogging(const std::string& level, LogFormat format);

/// What is known about an event, beside its name.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::uint64_t, double> value;
};

/// One line for something that has happened to the server, a stream or a caller. As text:
/// `stream opened id=7 name="two words"`; as JSON the fields stand beside the message:
/// {"time":...,"level":"info","message":"stream opened","id":7,"name":"two words"}. Values may come
/// from clients: what would break a line is escaped.
void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields);

/// A caller that was not let in, or what it asked for was not: who, and why.
void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status);

/// What gives a line its format, for a sink of one's own.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace partiemc::server
