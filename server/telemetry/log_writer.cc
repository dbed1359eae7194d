#include "server/telemetry/log_writer.h"

#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <string>
#include <utility>

namespace partiemc::server {
namespace {

constexpr std::chrono::milliseconds kLastPatience(500);
constexpr std::chrono::seconds kTick(1);

// Returns the number of bytes that were not written.
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

}  // namespace

struct LogWriter::State {
  explicit State(Options given) : options(std::move(given)) {}

  const Options options;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::string waiting;  // Guarded by the mutex, like the next member.
  bool stop = false, ended = false;
  std::atomic<bool> behind = false;  // Lines are buffered or being written.
  std::atomic<std::uint64_t> dropped = 0;
};

LogWriter::LogWriter(Options options)
    : state_(std::make_shared<State>(std::move(options))),
      thread_([state = state_] { Run(state); }) {}

void LogWriter::Stop() {
  if (!thread_.joinable()) return;
  Flush(kLastPatience);
  std::unique_lock lock(state_->mutex);
  state_->stop = true;
  state_->changed.notify_all();
  const bool ended =
      state_->changed.wait_for(lock, kLastPatience, [this] { return state_->ended; });
  lock.unlock();
  if (ended) {
    thread_.join();
  } else {
    thread_.detach();
  }
}

void LogWriter::Write(std::string_view line) {
  const std::lock_guard lock(state_->mutex);
  if (state_->stop || state_->waiting.size() + line.size() > state_->options.capacity) {
    ++state_->dropped;
    return;
  }
  state_->waiting += line;
  state_->behind = true;
  state_->changed.notify_all();
}

bool LogWriter::Flush(std::chrono::milliseconds patience) const {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, patience, [this] { return !state_->behind; });
}

void LogWriter::FlushInSignal(std::chrono::milliseconds patience) const {
  constexpr timespec kPause{.tv_sec = 0, .tv_nsec = 1'000'000};
  for (auto k = patience.count(); k > 0 && state_->behind; --k) nanosleep(&kPause, nullptr);
}

std::uint64_t LogWriter::dropped() const { return state_->dropped; }

void LogWriter::Run(const std::shared_ptr<State>& state) {
  auto next_tick = std::chrono::steady_clock::now() + kTick;
  std::string lines;
  std::unique_lock lock(state->mutex);
  while (!state->stop) {
    state->changed.wait_until(lock, next_tick,
                              [&] { return state->stop || !state->waiting.empty(); });
    lines.swap(state->waiting);
    lock.unlock();
    const std::string_view left = WriteAll(state->options.file, lines);
    state->dropped += static_cast<std::uint64_t>(std::count(left.begin(), left.end(), '\n'));
    lines.clear();
    lock.lock();
    if (!state->stop && std::chrono::steady_clock::now() >= next_tick) {
      lock.unlock();
      if (state->options.every_second) state->options.every_second();
      next_tick = std::chrono::steady_clock::now() + kTick;
      lock.lock();
    }
    state->behind = !state->waiting.empty();
    state->changed.notify_all();
  }
  state->ended = true;
  state->changed.notify_all();
}

}  // namespace partiemc::server
