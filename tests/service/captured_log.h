// Captures the server's log during a test.
#pragma once

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/telemetry/logging.h"

namespace partiemc::server {

/// Lines of the server and of gRPC at all levels, during the lifetime of this object.
class CapturedLog {
 public:
  explicit CapturedLog(LogFormat format = LogFormat::kText) : before_(spdlog::default_logger()) {
    SetUpLogging("trace", format);
    spdlog::default_logger()->sinks() = {sink_};
    sink_->set_formatter(MakeLogFormatter(format));
  }
  ~CapturedLog() { spdlog::set_default_logger(before_); }
  CapturedLog(const CapturedLog&) = delete;
  CapturedLog& operator=(const CapturedLog&) = delete;

  std::string Text() const { return sink_->Text(); }

  /// Number of occurrences of `words`.
  std::size_t Count(const std::string& words) const {
    const std::string text = Text();
    std::size_t count = 0;
    for (std::size_t at = text.find(words); at != text.npos; at = text.find(words, at + 1)) ++count;
    return count;
  }

 private:
  class Sink final : public spdlog::sinks::base_sink<std::mutex> {
   public:
    std::string Text() {
      const std::lock_guard lock(mutex_);
      return text_;
    }

   private:
    void sink_it_(const spdlog::details::log_msg& message) override {
      spdlog::memory_buf_t line;
      formatter_->format(message, line);
      text_.append(line.data(), line.size());
    }
    void flush_() override {}

    std::string text_;
  };

  std::shared_ptr<spdlog::logger> before_;
  std::shared_ptr<Sink> sink_ = std::make_shared<Sink>();
};

}  // namespace partiemc::server
