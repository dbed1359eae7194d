// Writes log lines on a separate thread, so that callers never wait.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <thread>

namespace partiemc::server {

class LogWriter {
 public:
  struct Options {
    int file = STDERR_FILENO;
    /// Capacity of the buffer in bytes; another buffer of this size may be written at the same
    /// time.
    std::size_t capacity = std::size_t{1} << 20;
    /// Called by the writer thread about once per second.
    std::function<void()> every_second = {};
  };

  explicit LogWriter(Options options);
  ~LogWriter() { Stop(); }
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Never waits for the file. Drops and counts a line if the buffer is full or the file fails (a
  /// closed pipe). Thread-safe.
  void Write(std::string_view line);

  /// Waits up to `patience` until everything is written. Returns whether it is.
  bool Flush(std::chrono::milliseconds patience) const;

  /// Flush for a signal handler, without a lock.
  void FlushInSignal(std::chrono::milliseconds patience) const;

  /// Flushes for half a second and ends the thread. Later lines are dropped. A thread that blocks
  /// on a full pipe is abandoned.
  void Stop();

  std::uint64_t dropped() const;

 private:
  struct State;
  static void Run(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_;  // Shared with the thread, which may be abandoned.
  std::thread thread_;
};

}  // namespace partiemc::server
