#include "server/telemetry/logging.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <signal.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <mutex>
#include <utility>

#include "common/json_text.h"
#include "partiemc/status.h"
#include "server/base/rate_limit.h"
#include "server/telemetry/log_writer.h"

namespace partiemc::server {
namespace {

// Marks a log payload whose fields are JSON: such a payload begins with this character, and no
// other payload does.
constexpr char kFieldsFollow = '\x1e';

constexpr std::uint32_t kRefusalsPerSecond = 20;
// All ranks of a simulation join their stream at the same time (--max-parts).
constexpr std::uint32_t kCallsPerSecond = 500;
constexpr std::chrono::milliseconds kPatienceOnAbort(500);

std::atomic<LogFormat> log_format = LogFormat::kText;
RateLimit refusals(kRefusalsPerSecond), calls(kCallsPerSecond);
// The writer of the log, set by SetUpLogging. Never destroyed, because abandoned threads may log
// until the process ends.
std::shared_ptr<LogWriter>& writer = *new std::shared_ptr<LogWriter>;
// The logger. Never destroyed, unlike spdlog's default logger, which is destroyed after
// main has returned.
std::shared_ptr<spdlog::logger>& logger =
    *new std::shared_ptr<spdlog::logger>(spdlog::default_logger());

bool IsPlain(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return c > 0x20 && c < 0x7f && c != '"' && c != '\\' && c != '=';
  });
}

std::string ToText(const LogField& field, bool json) {
  if (const auto* text = std::get_if<std::string>(&field.value)) {
    return json || !IsPlain(*text) ? JsonString(*text) : *text;
  }
  if (const auto* count = std::get_if<std::uint64_t>(&field.value)) return std::to_string(*count);
  return fmt::format("{:.3f}", std::get<double>(field.value));
}

// One JSON object per line: {"time":"2024-05-01T12:00:00.000Z","level":"info","message":"..."}.
class JsonFormatter final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const auto time = std::chrono::floor<std::chrono::milliseconds>(message.time);
    const auto milliseconds = time.time_since_epoch().count() % 1000;
    const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
    std::tm parts{};
    gmtime_r(&seconds, &parts);
    const auto level = spdlog::level::to_string_view(message.level);
    const std::string_view payload(message.payload.data(), message.payload.size());
    const bool fields = payload.starts_with(kFieldsFollow);
    fmt::format_to(std::back_inserter(out),
                   R"({{"time":"{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z","level":"{}",)"
                   R"("message":{}}})"
                   "\n",
                   parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday, parts.tm_hour,
                   parts.tm_min, parts.tm_sec, milliseconds,
                   fmt::string_view(level.data(), level.size()),
                   fields ? std::string(payload.substr(1)) : JsonString(payload));
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

// Logs gRPC's errors at level debug only: they concern gRPC's internals, and the server itself logs
// errors for users. gRPC's messages below level error are dropped, because they may contain
// transferred data.
void LogFromGrpc(gpr_log_func_args* message) {
  if (message->severity != GPR_LOG_SEVERITY_ERROR) return;
  LogEvent(spdlog::level::debug, "grpc", {{"says", std::string(message->message)}});
}

class WriterSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit WriterSink(std::shared_ptr<LogWriter> to) : to_(std::move(to)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    to_->Write({line.data(), line.size()});
  }
  void flush_() override {}

  const std::shared_ptr<LogWriter> to_;
};

// Logs how many refusals and calls were held back, and how many lines were dropped since the last
// call.
void TellLosses() {
  if (const auto count = refusals.TakeHeldBack(); count > 0) {
    LogEvent(spdlog::level::warn, "more refusals", {{"count", count}});
  }
  if (const auto count = calls.TakeHeldBack(); count > 0) {
    LogEvent(spdlog::level::warn, "more calls", {{"count", count}});
  }
  static std::atomic<std::uint64_t> told = 0;
  const std::uint64_t dropped = LossesOfLog().dropped_lines;
  if (const auto before = told.exchange(dropped); dropped > before) {
    LogEvent(spdlog::level::warn, "log lines dropped", {{"count", dropped - before}});
  }
}

void OnAbort(int signal) {
  if (writer) writer->FlushInSignal(kPatienceOnAbort);
  raise(signal);  // SA_RESETHAND has restored the default action.
}

}  // namespace

std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format) {
  if (format == LogFormat::kJson) return std::make_unique<JsonFormatter>();
  return std::make_unique<spdlog::pattern_formatter>("%Y-%m-%d %H:%M:%S.%e %l %v");
}

void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields) {
  const bool json = log_format == LogFormat::kJson;
  std::string line = json ? kFieldsFollow + JsonString(event) : std::string(event);
  for (const LogField& field : fields) {
    line += json ? ",\"" : " ";
    line += field.name;
    line += json ? "\":" : "=";
    line += ToText(field, json);
  }
  logger->log(level, fmt::string_view("{}"), line);
}

void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status,
                const std::string& client) {
  if (!refusals.Allow(RateLimit::Clock::now())) return;
  const auto violation = FindViolation(status);
  LogEvent(spdlog::level::warn, event,
           {{"peer", peer},
            {"client", client},
            {"status", absl::StatusCodeToString(status.code())},
            {"reason", violation ? violation->reason : std::string()},
            {"error", std::string(status.message())}});
}

void LogCall(std::string_view event, std::initializer_list<LogField> fields) {
  constexpr auto kLevel = spdlog::level::info;
  if (!logger->should_log(kLevel) || !calls.Allow(RateLimit::Clock::now())) return;
  LogEvent(kLevel, event, fields);
}

void SetUpLogging(const std::string& level, LogFormat format) {
  log_format = format;
  writer = std::make_shared<LogWriter>(LogWriter::Options{.every_second = &TellLosses});
  logger =
      std::make_shared<spdlog::logger>("partiemc-server", std::make_shared<WriterSink>(writer));
  logger->set_formatter(MakeLogFormatter(format));
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(logger);
  static const int registered = std::atexit([] {
    FlushLog();
    writer->Stop();
  });
  static_cast<void>(registered);
  gpr_set_log_function(&LogFromGrpc);
  // Disables Protobuf's log handler, which would print a line on standard error for every malformed
  // message.
  google::protobuf::SetLogHandler(nullptr);
}

void RefuseTraces() {
  if (std::getenv("GRPC_TRACE") == nullptr) return;
  unsetenv("GRPC_TRACE");
  LogEvent(spdlog::level::warn, "GRPC_TRACE ignored",
           {{"error", "gRPC's traces print tokens; the log holds none"}});
}

void FlushLogOnAbort() {
  struct sigaction action = {};
  action.sa_handler = OnAbort;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGABRT, &action, nullptr);
}

void FlushLog(std::chrono::milliseconds patience) {
  TellLosses();
  if (writer) writer->Flush(patience);
}

LogLosses LossesOfLog() {
  return {.dropped_lines = writer ? writer->dropped() : 0,
          .refusals_held_back = refusals.held_back_in_all(),
          .calls_held_back = calls.held_back_in_all()};
}

}  // namespace partiemc::server
