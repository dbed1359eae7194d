// Writes log lines on a separate thread, so that the threads that log never wait.
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
    /// Capacity of the buffer in bytes. While one buffer is being written to the file, a second one
    /// of this size may fill.
    std::size_t capacity = std::size_t{1} << 20;
    /// The writer thread calls this function about once per second.
    std::function<void()> every_second = {};
  };

  explicit LogWriter(Options options);
  ~LogWriter() { Stop(); }
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Queues a line; never waits for the file. If the buffer is full or the file fails (a closed
  /// pipe), drops the line and counts it. Thread-safe.
  void Write(std::string_view line);

  /// Waits until everything is written, at most `patience`. Returns whether everything was written.
  bool Flush(std::chrono::milliseconds patience) const;

  /// Same as Flush, for a signal handler: takes no lock.
  void FlushInSignal(std::chrono::milliseconds patience) const;

  /// Flushes for at most half a second and ends the writer thread. Lines that follow are dropped.
  /// If the thread blocks on a full pipe for another half second, it is abandoned, and the lines
  /// that wait for it are dropped.
  void Stop();

  std::uint64_t dropped() const;

 private:
  struct State;
  static void Run(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_;  // Shared with the thread, which may be abandoned.
  std::thread thread_;
};

}  // namespace partiemc::server
