// The log: one line per event of the server or of a stream, to standard error.
#pragma once

#include <spdlog/formatter.h>

#include <memory>
#include <string>

namespace partiemc::server {

enum class LogFormat { kText, kJson };

/// Sets up spdlog's default logger, and has gRPC's own messages go there at level debug.
/// `level` is one of trace, debug, info, warn, error, off. Called once, before threads start.
void SetUpLogging(const std::string& level, LogFormat format);

/// What gives a line its format, for a sink of one's own.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace partiemc::server
