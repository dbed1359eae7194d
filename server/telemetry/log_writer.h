// The log on its way out: lines are handed over without waiting, and a thread of their own writes
// them.
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
    /// Bytes of lines that wait to be written; as many again may be being written.
    std::size_t capacity = std::size_t{1} << 20;
    /// Called by the thread about once a second.
    std::function<void()> every_second = {};
  };

  explicit LogWriter(Options options);
  ~LogWriter() { Stop(); }
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Never waits for the file. A line for which there is no room is dropped and counted, as are
  /// those that the file refuses (a pipe whose reader has gone). Safe from any thread.
  void Write(std::string_view line);

  /// Whether everything has been written before `patience` is over.
  bool Flush(std::chrono::milliseconds patience) const;

  /// The same for a signal handler: it takes no lock.
  void FlushInSignal(std::chrono::milliseconds patience) const;

  /// Flush with half a second's patience, and the end of the thread: it calls `every_second` no
  /// more, and lines that come from now on are dropped. One that a full pipe holds is left behind.
  void Stop();

  std::uint64_t dropped() const;

 private:
  struct State;
  static void Run(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_;  // The thread's too, as it may be left behind.
  std::thread thread_;
};

}  // namespace partiemc::server
