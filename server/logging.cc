#include "server/logging.h"

#include <grpc/support/log.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <iterator>
#include <memory>

#include "partiemc/status.h"

namespace partiemc::server {
namespace {

// Begins the payload of a line whose fields are JSON already; nothing else can begin with it.
constexpr char kFieldsFollow = '\x1e';

std::atomic<LogFormat> log_format = LogFormat::kText;

void AppendEscaped(std::string_view text, std::string& out) {
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
}

std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  AppendEscaped(text, quoted);
  return quoted + "\"";
}

bool IsPlain(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) {
    return c > 0x20 && c < 0x7f && c != '"' && c != '\\' && c != '=';
  });
}

std::string ToText(const LogField& field, bool json) {
  if (const auto* text = std::get_if<std::string>(&field.value)) {
    return json || !IsPlain(*text) ? Quoted(*text) : *text;
  }
  if (const auto* count = std::get_if<std::uint64_t>(&field.value)) return std::to_string(*count);
  return fmt::format("{:.3f}", std::get<double>(field.value));
}

// One JSON object a line: {"time":"2024-05-01T12:00:00.000Z","level":"info","message":"..."}.
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
                   fields ? std::string(payload.substr(1)) : Quoted(payload));
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

// What gRPC says is about its own insides; what went wrong for a user is told in our own words.
void LogFromGrpc(gpr_log_func_args* message) { spdlog::debug("grpc: {}", message->message); }

}  // namespace

std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format) {
  if (format == LogFormat::kJson) return std::make_unique<JsonFormatter>();
  return std::make_unique<spdlog::pattern_formatter>("%Y-%m-%d %H:%M:%S.%e %l %v");
}

void LogEvent(spdlog::level::level_enum level, std::string_view event,
              std::initializer_list<LogField> fields) {
  const bool json = log_format == LogFormat::kJson;
  std::string line = json ? kFieldsFollow + Quoted(event) : std::string(event);
  for (const LogField& field : fields) {
    line += json ? ",\"" : " ";
    line += field.name;
    line += json ? "\":" : "=";
    line += ToText(field, json);
  }
  spdlog::log(level, fmt::string_view("{}"), line);
}

void LogRefusal(std::string_view event, const std::string& peer, const absl::Status& status) {
  const auto violation = FindViolation(status);
  LogEvent(spdlog::level::warn, event,
           {{"peer", peer},
            {"status", absl::StatusCodeToString(status.code())},
            {"reason", violation ? violation->reason : std::string()},
            {"error", std::string(status.message())}});
}

void SetUpLogging(const std::string& level, LogFormat format) {
  log_format = format;
  auto logger = std::make_shared<spdlog::logger>("partiemc-server",
                                                 std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(MakeLogFormatter(format));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(std::move(logger));
  gpr_set_log_function(&LogFromGrpc);
}

}  // namespace partiemc::server
