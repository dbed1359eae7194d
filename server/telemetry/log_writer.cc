#include "server/telemetry/log_writer.h"

#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <ctime>
#include <string>
#include <utility>

#include "common/mutex.h"

namespace partiemc::server {
namespace {

constexpr std::chrono::milliseconds kLastPatience(500);
constexpr std::chrono::seconds kTick(1);

// Writes the bytes until all are written or an error occurs. Returns the bytes that were not
// written.
std::string_view WriteAll(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(file, bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // Another process has made the shared file non-blocking.
      pollfd ready{.fd = file, .events = POLLOUT, .revents = 0};
      poll(&ready, 1, /*timeout=*/-1);
    } else if (errno != EINTR) {
      break;
    }
  }
  return bytes;
}

std::uint64_t LinesOf(std::string_view text) {
  return static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

struct LogWriter::State {
  explicit State(Options given) : options(std::move(given)) {}

  const Options options;
  mutable Mutex mutex;
  mutable CondVar changed;
  std::string waiting ABSL_GUARDED_BY(mutex);
  bool stop ABSL_GUARDED_BY(mutex) = false;
  bool ended ABSL_GUARDED_BY(mutex) = false;
  std::atomic<bool> behind = false;  // Lines are buffered or being written.
  std::atomic<std::uint64_t> dropped = 0;
};

LogWriter::LogWriter(Options options)
    : state_(std::make_shared<State>(std::move(options))),
      thread_([state = state_] { Run(state); }) {}

void LogWriter::Stop() {
  if (!thread_.joinable()) return;
  Flush(kLastPatience);
  bool ended = false;
  {
    const auto deadline = std::chrono::steady_clock::now() + kLastPatience;
    const MutexLock lock(state_->mutex);
    state_->stop = true;
    state_->changed.NotifyAll();
    while (!state_->ended && state_->changed.WaitUntil(state_->mutex, deadline)) {
    }
    ended = state_->ended;
    if (!ended) {  // The process ends before the thread can write them.
      state_->dropped += LinesOf(state_->waiting);
      state_->waiting.clear();
    }
  }
  if (ended) {
    thread_.join();
  } else {
    thread_.detach();
  }
}

void LogWriter::Write(std::string_view line) {
  const MutexLock lock(state_->mutex);
  if (state_->stop || state_->waiting.size() + line.size() > state_->options.capacity) {
    ++state_->dropped;
    return;
  }
  state_->waiting += line;
  state_->behind = true;
  state_->changed.NotifyAll();
}

bool LogWriter::Flush(std::chrono::milliseconds patience) const {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  const MutexLock lock(state_->mutex);
  while (state_->behind && state_->changed.WaitUntil(state_->mutex, deadline)) {
  }
  return !state_->behind;
}

void LogWriter::FlushInSignal(std::chrono::milliseconds patience) const {
  constexpr timespec kPause{.tv_sec = 0, .tv_nsec = 1'000'000};
  for (auto k = patience.count(); k > 0 && state_->behind; --k) nanosleep(&kPause, nullptr);
}

std::uint64_t LogWriter::dropped() const { return state_->dropped; }

void LogWriter::Run(const std::shared_ptr<State>& state) {
  auto next_tick = std::chrono::steady_clock::now() + kTick;
  std::string lines;
  const MutexLock lock(state->mutex);
  while (!state->stop || !state->waiting.empty()) {
    while (!state->stop && state->waiting.empty() &&
           state->changed.WaitUntil(state->mutex, next_tick)) {
    }
    lines.swap(state->waiting);
    {
      const MutexUnlock unlock(state->mutex);
      const std::string_view left = WriteAll(state->options.file, lines);
      state->dropped += LinesOf(left);
      lines.clear();
    }
    if (!state->stop && std::chrono::steady_clock::now() >= next_tick) {
      const MutexUnlock unlock(state->mutex);
      if (state->options.every_second) state->options.every_second();
      next_tick = std::chrono::steady_clock::now() + kTick;
    }
    state->behind = !state->waiting.empty();
    state->changed.NotifyAll();
  }
  state->ended = true;
  state->changed.NotifyAll();
}

}  // namespace partiemc::server
