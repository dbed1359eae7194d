#include "client/cli/load/load.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_format.h"
#include "client/cli/console.h"
#include "client/cli/load/latencies.h"
#include "client/cli/load/load_frames.h"
#include "client/cli/load/server_figures.h"
#include "client/output/text.h"
#include "common/json_text.h"
#include "common/mutex.h"
#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {
namespace {

using Clock = std::chrono::steady_clock;

// Length of a measuring window. The run ends once the percentiles of two consecutive windows agree
// (HaveSettled).
constexpr std::chrono::seconds kWindow(2);
// Size of the ring buffers that hold times by sequence number. It is larger than any number of
// frames in flight.
constexpr std::size_t kRemembered = 4096;

double Milliseconds(Clock::duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

double SecondsOf(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double CpuSecondsOf(std::thread& thread) {
  clockid_t clock{};
  return pthread_getcpuclockid(thread.native_handle(), &clock) == 0 ? SecondsOf(clock) : 0;
}

struct Shared {
  const LoadFlags& flags;
  std::vector<std::vector<float>> frames;
  std::vector<std::uint64_t> ids;
  Latencies answers, watches;
  std::atomic<std::uint64_t> answered = 0, late = 0, refused = 0;
  std::atomic<bool> stop = false;
  Mutex mutex;
  absl::Status error ABSL_GUARDED_BY(mutex);  // The first error.

  void Fail(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mutex) {
    const MutexLock lock(mutex);
    if (error.ok()) error = status;
    stop = true;
  }
  absl::Status Error() ABSL_LOCKS_EXCLUDED(mutex) {
    const MutexLock lock(mutex);
    return error;
  }
};

class LoadedStream {
 public:
  LoadedStream(Shared& shared, int number)
      : shared_(shared), number_(number), name_(Concat("load-", getpid(), "-", number)) {}

  const std::string& name() const { return name_; }

  absl::Status Open() {
    StreamOptions options{.name = name_, .credentials = shared_.flags.server.credentials};
    options.reconnect.give_up_after = kShortPatience;
    options.parameters.spacing = 1;
    if (shared_.flags.surface) options.parameters.output = Output::kSurface;
    options.outputs.coordinates = CoordinatesOf(shared_.flags.coordinates);
    auto stream = Stream::Open(shared_.flags.server.address, options);
    if (!stream.ok()) return stream.status();
    stream_ = *std::move(stream);
    return absl::OkStatus();
  }

  void Start(Clock::time_point start) {
    // Streams start at different times within a period, as independent simulators do.
    start_ = start + PeriodTimes(static_cast<double>(number_) / shared_.flags.streams);
    sender_ = std::thread([this] { Send(); });
    receiver_ = std::thread([this] { Receive(); });
  }

  void Join() {
    sender_.join();
    receiver_.join();
  }

  // Processor time of the two threads, which includes most of gRPC's work.
  double CpuSeconds() { return CpuSecondsOf(sender_) + CpuSecondsOf(receiver_); }

  // Arrival time of the response to a frame that has been sent. Empty if the response has not
  // arrived. If more than kRemembered / 2 later frames have been sent, the time of a later frame.
  std::optional<Clock::time_point> AnsweredAt(std::uint64_t sequence) const {
    const std::uint64_t sent = sent_;
    if (sent > kRemembered / 2) sequence = std::max(sequence, sent - kRemembered / 2);
    const auto at = answered_at_[sequence % kRemembered].load();
    if (at == Clock::duration::rep{0}) return std::nullopt;
    return Clock::time_point(Clock::duration(at));
  }

 private:
  using Times = std::array<std::atomic<Clock::duration::rep>, kRemembered>;

  Clock::duration PeriodTimes(double count) const {
    if (shared_.flags.rate <= 0) return {};
    return std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(count / shared_.flags.rate));
  }

  void Send() {
    for (std::uint64_t k = 0; !shared_.stop; ++k) {
      Clock::time_point due = Clock::now();
      if (shared_.flags.rate > 0) {
        due = start_ + PeriodTimes(static_cast<double>(k));
        std::this_thread::sleep_until(due);
      }
      sent_ = k + 1;
      due_[(k + 1) % kRemembered] = due.time_since_epoch().count();
      answered_at_[(k + 1) % kRemembered] = 0;  // Removes the time of an earlier frame.
      const std::vector<float>& frame = shared_.frames[k % shared_.frames.size()];
      const auto sent = stream_->Send({.positions = std::span<const float>(frame),
                                       .components = shared_.flags.surface ? 3 : 2,
                                       .ids = shared_.ids},
                                      static_cast<double>(k));
      if (!sent.ok()) {
        shared_.Fail(sent.status());
        break;
      }
    }
    stream_->FinishSending().IgnoreError();
  }

  void Receive() {
    Event event;
    for (;;) {
      const auto got = stream_->Receive(event);
      if (!got.ok()) return shared_.Fail(got.status());
      if (*got == Received::kEnd) return;
      if (event.kind == Event::Kind::kRefusal) ++shared_.refused;
      if (event.kind != Event::Kind::kResult) continue;
      const auto now = Clock::now();
      answered_at_[event.sequence % kRemembered] = now.time_since_epoch().count();
      const Clock::time_point due{Clock::duration(due_[event.sequence % kRemembered].load())};
      shared_.answers.Add(Milliseconds(now - due));
      ++shared_.answered;
      // A frame is late if its response came after the next frame was due.
      if (shared_.flags.rate > 0 && now > due + PeriodTimes(1)) ++shared_.late;
    }
  }

  Shared& shared_;
  const int number_;
  const std::string name_;
  std::unique_ptr<Stream> stream_;
  Clock::time_point start_;
  std::atomic<std::uint64_t> sent_ = 0;  // Number of the frame that is being sent.
  Times due_{}, answered_at_{};
  std::thread sender_, receiver_;
};

void WatchStream(Shared& shared, const LoadedStream& stream, const std::string& server) {
  const auto watcher =
      Watcher::Open(server, stream.name(), {.credentials = shared.flags.server.credentials});
  if (!watcher.ok()) return shared.Fail(watcher.status());
  WatchedFrame frame;
  while (!shared.stop) {
    const auto got = (*watcher)->Receive(frame, std::chrono::milliseconds(200));
    if (!got.ok()) {
      if (!shared.stop) shared.Fail(got.status());
      return;
    }
    if (*got == Received::kEnd) return;
    if (*got != Received::kEvent) continue;
    const auto now = Clock::now();
    // If the watcher received the result before the producer, the delay counts as 0. The delay of a
    // watcher that is far behind is a lower bound.
    const auto answered = stream.AnsweredAt(frame.sequence);
    shared.watches.Add(answered ? std::max(Milliseconds(now - *answered), 0.0) : 0.0);
  }
}

double CpuSeconds() { return SecondsOf(CLOCK_PROCESS_CPUTIME_ID); }

double CpuSecondsOf(const std::vector<std::unique_ptr<LoadedStream>>& streams) {
  double seconds = 0;
  for (const auto& stream : streams) seconds += stream->CpuSeconds();
  return seconds;
}

double MemoryMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// Results of the run without its first window, in which buffers grow. Exceptions: `refused` and the
// memory cover the whole run.
struct Figures {
  double seconds = 0;
  bool settled = false;
  Percentiles answers, watches;
  std::uint64_t frames = 0, late = 0, refused = 0;
  double client_cpu_ms = 0, producer_cpu_ms = 0;  // Per frame.
  double client_memory_mb = 0;
  std::optional<double> server_cpu_ms, server_memory_mb;
};

// Collects response times until the percentiles have settled, the time is up, or a signal arrives.
absl::StatusOr<Figures> Measure(Shared& shared,
                                const std::vector<std::unique_ptr<LoadedStream>>& streams) {
  const LoadFlags& flags = shared.flags;
  const bool tells = !flags.quiet && isatty(STDERR_FILENO) != 0;
  const auto begin = Clock::now();
  std::vector<double> answers, watches;
  Percentiles before;
  Figures figures;
  std::uint64_t frames_before = 0, late_before = 0;
  double cpu_before = 0, producer_cpu_before = 0;
  std::optional<ServerFigures> server_before;
  Clock::time_point measured_from;
  for (int window = 0;; ++window) {
    const auto end = begin + (window + 1) * kWindow;
    while (Clock::now() < end && !shared.stop && !Interrupted()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if (auto status = shared.Error(); !status.ok()) return status;
    std::vector<double> times = shared.answers.Take(), watched = shared.watches.Take();
    if (window == 0) {
      measured_from = Clock::now();
      frames_before = shared.answered;
      late_before = shared.late;
      cpu_before = CpuSeconds();
      producer_cpu_before = CpuSecondsOf(streams);
      if (!flags.metrics.empty()) {
        const auto server = AskFigures(flags.metrics);
        if (!server.ok()) return server.status();
        server_before = *server;
      }
    } else {
      answers.insert(answers.end(), times.begin(), times.end());
      watches.insert(watches.end(), watched.begin(), watched.end());
    }
    const Percentiles now = PercentilesOf(times);
    if (tells) {
      std::fprintf(stderr, "\r%4.0f s: %zu answers, p50 %.1f ms, p99 %.1f ms   ",
                   Milliseconds(Clock::now() - begin) / 1000, now.count, now.p50, now.p99);
    }
    figures.settled = window >= 2 && HaveSettled(before, now);
    before = now;
    const bool is_over =
        Clock::now() + kWindow / 2 > begin + std::chrono::duration_cast<Clock::duration>(
                                                 std::chrono::duration<double>(flags.seconds));
    if (figures.settled || Interrupted() || (is_over && window > 0)) break;
  }
  if (tells) std::fprintf(stderr, "\n");
  figures.seconds = Milliseconds(Clock::now() - measured_from) / 1000;
  figures.answers = PercentilesOf(answers);
  figures.watches = PercentilesOf(watches);
  figures.frames = shared.answered - frames_before;
  figures.late = shared.late - late_before;
  figures.refused = shared.refused;
  const double per_frame = 1000 / std::max<double>(1, static_cast<double>(figures.frames));
  figures.client_cpu_ms = (CpuSeconds() - cpu_before) * per_frame;
  figures.producer_cpu_ms = (CpuSecondsOf(streams) - producer_cpu_before) * per_frame;
  figures.client_memory_mb = MemoryMb();
  if (server_before) {
    const auto server = AskFigures(flags.metrics);
    if (!server.ok()) return server.status();
    figures.server_cpu_ms = (server->cpu_seconds - server_before->cpu_seconds) * per_frame;
    figures.server_memory_mb = server->memory_bytes / (1 << 20);
  }
  return figures;
}

std::string TextOf(const LoadFlags& flags, const Figures& figures) {
  const double reached = static_cast<double>(figures.frames) / figures.seconds;
  std::string text = absl::StrFormat(
      "%d streams of %d particles%s%s, %s; %d watchers\n%s after %.0f s of measuring\n\n"
      "                     p50      p90      p99      max\n",
      flags.streams, flags.particles, flags.no_ids ? "" : " with ids",
      flags.surface ? Concat(", surfaces in ", flags.coordinates) : std::string(),
      flags.rate > 0 ? absl::StrFormat("%g frames/s each", flags.rate) : "as fast as they go",
      flags.watchers, figures.settled ? "settled" : "NOT settled", figures.seconds);
  const auto row = [&](const char* name, const Percentiles& p) {
    absl::StrAppendFormat(&text, "%-15s %8.2f %8.2f %8.2f %8.2f\n", name, p.p50, p.p90, p.p99,
                          p.max);
  };
  row("answers, ms", figures.answers);
  if (flags.watchers > 0) row("watchers, ms", figures.watches);
  absl::StrAppendFormat(&text, "\n%.1f frames/s reached", reached);
  if (flags.rate > 0) {
    absl::StrAppendFormat(&text, " of %.1f, %d late (answered after the next one was due)",
                          flags.rate * flags.streams, figures.late);
  }
  absl::StrAppendFormat(&text,
                        "; %d refused\nclient: %.2f ms of processor time a frame, %.2f of them its "
                        "producers', %.0f MB\n",
                        figures.refused, figures.client_cpu_ms, figures.producer_cpu_ms,
                        figures.client_memory_mb);
  if (figures.server_cpu_ms) {
    absl::StrAppendFormat(&text, "server: %.2f ms of processor time a frame, %.0f MB\n",
                          *figures.server_cpu_ms, *figures.server_memory_mb);
  }
  return text;
}

std::string JsonOf(const LoadFlags& flags, const Figures& figures) {
  const auto percentiles = [](const Percentiles& p) {
    return Concat("{\"count\":", p.count, ",\"p50_ms\":", p.p50, ",\"p90_ms\":", p.p90,
                  ",\"p99_ms\":", p.p99, ",\"max_ms\":", p.max, "}");
  };
  const auto number = [](std::optional<double> value) { return value ? Concat(*value) : "null"; };
  return Concat(
      "{\"streams\":", flags.streams, ",\"particles\":", flags.particles, ",\"rate\":", flags.rate,
      ",\"surface\":", flags.surface ? "true" : "false", ",\"coordinates\":\"", flags.coordinates,
      "\",\"watchers\":", flags.watchers, ",\"ids\":", flags.no_ids ? "false" : "true",
      ",\"settled\":", figures.settled ? "true" : "false", ",\"seconds\":", figures.seconds,
      ",\"frames\":", figures.frames, ",\"late\":", figures.late, ",\"refused\":", figures.refused,
      ",\"answers\":", percentiles(figures.answers), ",\"watches\":", percentiles(figures.watches),
      ",\"client_cpu_ms\":", figures.client_cpu_ms,
      ",\"producer_cpu_ms\":", figures.producer_cpu_ms,
      ",\"client_memory_mb\":", figures.client_memory_mb,
      ",\"server_cpu_ms\":", number(figures.server_cpu_ms),
      ",\"server_memory_mb\":", number(figures.server_memory_mb), "}\n");
}

}  // namespace

CLI::App* AddLoad(CLI::App& app, LoadFlags& flags) {
  CLI::App* verb = app.add_subcommand("load", "Measure the capacity of a server");
  AddServerFlags(*verb, flags.server, "Server");
  verb->add_option("--streams", flags.streams, "Number of concurrent streams")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str()
      ->type_name("N");
  verb->add_option("--particles", flags.particles, "Number of particles per frame")
      ->check(CLI::Range(1, 10'000'000))
      ->capture_default_str()
      ->type_name("N");
  verb->add_option("--rate", flags.rate, "Frames per second and stream; 0: as fast as possible")
      ->check(CLI::Range(0.0, 100'000.0))
      ->capture_default_str()
      ->type_name("FPS");
  verb->add_flag("--surface", flags.surface,
                 "Send balls of particles in space and receive their surfaces");
  AddCoordinatesFlag(*verb, flags.coordinates);
  verb->add_option("--watchers", flags.watchers, "Number of watchers, distributed over the streams")
      ->check(CLI::Range(0, 100'000))
      ->capture_default_str()
      ->type_name("N");
  verb->add_option(
          "--watch-servers", flags.watch_servers,
          "Servers of the watchers, used in turn: replicas that share the streams of --server")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("ADDRESS,...");
  verb->add_flag("--no-ids", flags.no_ids, "Send no ids");
  verb->add_option(
          "--seconds", flags.seconds,
          "Longest duration, in seconds. The run ends earlier once median and 99th percentile "
          "of two consecutive windows of two seconds agree")
      ->check(CLI::Range(4.0, 1e6))
      ->capture_default_str()
      ->type_name("S");
  verb->add_option("--metrics", flags.metrics,
                   "Address of the server's --metrics, to report its processor time and memory")
      ->type_name("HOST:PORT");
  verb->add_flag("--json", flags.json, "Print one JSON object instead of a table");
  verb->add_flag("--quiet", flags.quiet, "No progress");
  verb->footer(
      "A response time counts from the moment at which the frame was due, so a server that falls\n"
      "behind has growing times. A watcher's time counts from the arrival of the producer's\n"
      "response. Exit code 0: nothing failed and no frame was refused.\n"
      "Examples:\n"
      "  partiemc-server --metrics 127.0.0.1:9464 &\n"
      "  partiemc load --streams 8 --metrics 127.0.0.1:9464\n"
      "  partiemc load --streams 1 --particles 1000000 --rate 0\n"
      "  partiemc load --streams 1 --watchers 50 --json\n"
      "  partiemc load --streams 1 --surface --particles 100000 --coordinates compact --rate 5\n"
      "  partiemc load --streams 1 --watchers 60 --watch-servers one:50051,two:50051");
  return verb;
}

int Load(const LoadFlags& flags) {
  Shared shared{.flags = flags, .frames = LoadFrames(flags.particles, flags.surface ? 3 : 2)};
  const std::size_t particles = shared.frames[0].size() / (flags.surface ? 3 : 2);
  for (std::size_t k = 0; !flags.no_ids && k < particles; ++k) shared.ids.push_back(k);
  if (!flags.metrics.empty()) {
    if (const auto server = AskFigures(flags.metrics); !server.ok()) {
      return ComplainOfServer(server.status());
    }
  }
  CatchInterrupts();
  std::vector<std::unique_ptr<LoadedStream>> streams;
  for (int k = 0; k < flags.streams; ++k) {
    streams.push_back(std::make_unique<LoadedStream>(shared, k));
    if (auto status = streams.back()->Open(); !status.ok()) return ComplainOfServer(status);
  }
  const auto start = Clock::now();
  for (const auto& stream : streams) stream->Start(start);
  std::vector<std::thread> watchers;
  std::vector<std::string> servers = flags.watch_servers;
  if (servers.empty()) servers.push_back(flags.server.address);
  for (int k = 0; k < flags.watchers; ++k) {
    watchers.emplace_back(
        [&, k] { WatchStream(shared, *streams[k % streams.size()], servers[k % servers.size()]); });
  }
  const auto figures = Measure(shared, streams);
  shared.stop = true;
  for (const auto& stream : streams) stream->Join();
  for (std::thread& watcher : watchers) watcher.join();
  if (!figures.ok()) return ComplainOfServer(figures.status());
  const std::string text = flags.json ? JsonOf(flags, *figures) : TextOf(flags, *figures);
  std::fputs(text.c_str(), stdout);
  if (Interrupted()) return kInterrupted;
  return figures->refused == 0 ? kGood : kFailed;
}

}  // namespace partiemc::client
