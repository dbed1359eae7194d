#include "client/cli/watch.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/stream_recorder.h"
#include "client/library/adapters/seconds.h"
#include "client/library/backoff.h"
#include "client/output/progress.h"
#include "client/output/text.h"
#include "common/text.h"
#include "partiemc/client/watcher.h"

namespace partiemc::client {
namespace {

using Clock = std::chrono::steady_clock;

// Poll interval for Ctrl-C while waiting for a frame.
constexpr std::chrono::milliseconds kPollInterval(100);

// Pauses between two searches for a stream that has not started. They double up to the longest. A
// stream that ends within a pause is missed, and its history with it.
constexpr std::chrono::milliseconds kFirstSearchPause(200), kLongestSearchPause(1000);

FrameRecord RecordOf(const WatchedFrame& frame, bool is_surface,
                     std::span<const float> particle_areas, std::span<const float> particle_sizes,
                     Boundary boundary, std::span<const std::size_t> sections_in_plane) {
  // No output shows particles in space.
  const std::span<const double> particles =
      is_surface ? std::span<const double>() : frame.particles;
  return {.index = frame.sequence - 1,  // A replay numbers its files in the same way.
          .time = frame.time,
          .result = frame.frame.result,
          .surface = is_surface ? &frame.frame.result.surface : nullptr,
          .particles = particles,
          .particle_areas = particle_areas,
          .particle_sizes = particle_sizes,
          .are_discs = boundary == Boundary::kGrains,
          .stages_ms = frame.frame.times.stages_ms,
          .total_ms = frame.frame.times.total_ms,
          .rings_digest = frame.frame.rings_digest,
          .mesh_digest = frame.frame.mesh_digest,
          .surface_digest = frame.frame.surface_digest,
          .section_digests = frame.frame.section_digests,
          .sections_in_plane = sections_in_plane};
}

constexpr std::string_view kOldest = "oldest";

std::optional<std::uint64_t> ParseFrom(std::string_view text) {
  const auto number = ParseNumber<std::uint64_t>(text);
  return number != 0u ? number : std::nullopt;
}

// The value of WatcherOptions::from_sequence.
std::optional<std::uint64_t> FromSequence(std::string_view from) {
  return from == kOldest ? std::optional<std::uint64_t>(0) : ParseFrom(from);
}

std::optional<LevelOfDetail> LevelOf(const WatchFlags& flags) {
  if (!flags.max_error && !flags.max_triangles) return std::nullopt;
  return LevelOfDetail{.max_error = flags.max_error, .max_triangles = flags.max_triangles};
}

struct Ended {
  ExitCode code = kGood;
  std::uint64_t dropped = 0;
  std::uint64_t gaps = 0, in_gaps = 0;  // Reconnections; upper bound of the frames missed.
  std::string word;                     // Why the watch ended early; empty for a regular end.

  Ended With(ExitCode end_code, std::string end_word) const {
    Ended ended = *this;
    ended.code = end_code;
    ended.word = std::move(end_word);
    return ended;
  }
};

// Details of a frame for the line of progress: "t = 1.25, 2278 particles, 5 polylines, 3 dropped".
std::string Detail(const WatchedFrame& frame, bool is_surface, std::uint64_t dropped) {
  const Result& result = frame.frame.result;
  std::string detail = Concat("t = ", frame.time, ", ", result.statistics.particles, " particles, ",
                              is_surface ? Plural(frame.level ? result.surface.TriangleCount()
                                                              : result.statistics.triangles,
                                                  "triangle")
                                         : Concat(result.rings.RingCount(), " polylines"));
  if (dropped > 0) AppendAll(detail, ", ", dropped, " dropped");
  return detail;
}

Ended ReceiveAll(const WatchFlags& flags, Watcher& watcher, FrameOutputs& outputs,
                 std::optional<StreamRecorder>& recorder, Progress& progress) {
  const ReconstructionParameters& parameters = watcher.stream().parameters;
  const std::vector<std::size_t> sections_in_plane = SectionsInPlane(parameters);
  const bool is_surface = parameters.output == Output::kSurface;
  Ended ended;
  WatchedFrame frame;
  for (std::uint64_t count = 0; flags.frames == 0 || count < flags.frames;) {
    if (Interrupted()) return ended.With(kInterrupted, "interrupted");
    const auto received = watcher.Receive(frame, kPollInterval);
    if (!received.ok()) {
      ended.dropped += watcher.end().dropped;
      return ended.With(kServer, OneLine(received.status()));
    }
    if (*received == Received::kNothingYet) {
      if (const auto lost = watcher.reconnecting()) progress.Wait(WaitingText(*lost));
      continue;
    }
    if (*received == Received::kEnd) {
      const bool finished = watcher.end().reason == "FINISHED";
      ended.dropped += watcher.end().dropped;
      if (finished) return ended;
      return ended.With(kServer, "the stream ended: " + OneLine(watcher.end().message));
    }
    ended.dropped += frame.dropped;
    if (!frame.rejoined.empty()) {
      ++ended.gaps;
      ended.in_gaps += frame.gap;
      progress.Note(Concat("partiemc: ", OneLine(frame.rejoined), "; missed: at most ",
                           Plural(frame.gap, "frame")));
    }
    const std::vector<float> areas = AreasOf(frame.particle_volumes, parameters.boundary);
    const std::vector<float> sizes = SizesOf(frame.particle_volumes, parameters.sizes);
    absl::Status status = outputs.Write(
        RecordOf(frame, is_surface, areas, sizes, parameters.boundary, sections_in_plane));
    if (status.ok() && recorder) status = recorder->Add(frame);
    if (!status.ok()) return ended.With(kFailed, OneLine(status));
    progress.Update(++count, Detail(frame, is_surface, ended.dropped));
  }
  return ended;
}

// Checks and sets the flags that --record requires.
void CompleteRecording(WatchFlags& flags, bool has_mode) {
  if (flags.record.empty()) return;
  if (!std::string_view(flags.record).ends_with(".pemc")) {
    throw CLI::ValidationError(
        Concat("--record: '", flags.record, "'; must end in .pemc, the format of recordings"));
  }
  if (has_mode && flags.mode != "every") {
    throw CLI::ValidationError(
        Concat("--record: with --mode ", flags.mode, "; requires --mode every"));
  }
  flags.mode = "every";
}

// Begins with the oldest frame if the user wants all frames of a recording, or of a stream that
// starts: its first frames can be sent before the search finds it.
void CompleteFrom(WatchFlags& flags) {
  const bool wants_all = !flags.record.empty() || (flags.wait && flags.mode == "every");
  if (wants_all && flags.from.empty()) flags.from = kOldest;
}

absl::StatusOr<std::unique_ptr<Watcher>> OpenWatcher(const WatchFlags& flags) {
  const std::vector<std::string_view> servers = Split(flags.server.address, ',');
  return Watcher::Open(servers.front(), flags.stream,
                       {.mode = flags.mode == "every" ? WatchMode::kEvery : WatchMode::kLatest,
                        .credits = flags.credits,
                        .from_sequence = FromSequence(flags.from),
                        .level_of_detail = LevelOf(flags),
                        .credentials = flags.server.credentials,
                        .fallback_addresses = {servers.begin() + 1, servers.end()},
                        .rejoin = {.give_up_after = ToMilliseconds(flags.give_up_after_seconds)},
                        .deadline = ToMilliseconds(flags.deadline_seconds)});
}

Progress::Options ProgressOptions(const WatchFlags& flags) {
  Progress::Options options = Progress::ForStandardError();
  options.quiet = flags.quiet;
  if (flags.frames > 0) options.total = flags.frames;
  return options;
}

// Waits for `pause`. Returns false after Ctrl-C.
bool Sleep(std::chrono::milliseconds pause) {
  for (const auto end = Clock::now() + pause; !Interrupted();) {
    const auto left = end - Clock::now();
    if (left <= Clock::duration::zero()) return true;
    std::this_thread::sleep_for(std::min<Clock::duration>(left, kPollInterval));
  }
  return false;
}

// Opens the watch. With --wait it retries until the stream exists, even if the server becomes
// unreachable in between, for example to restart. Shows `progress` from the first retry on. Errors:
// as Watcher::Open; CANCELLED after Ctrl-C.
absl::StatusOr<std::unique_ptr<Watcher>> OpenOrWait(const WatchFlags& flags,
                                                    std::optional<Progress>& progress) {
  Backoff backoff({.first_pause = kFirstSearchPause, .longest_pause = kLongestSearchPause},
                  /*address_count=*/1, std::random_device()());
  for (bool waited = false;; waited = true) {
    auto watcher = OpenWatcher(flags);
    const bool absent =
        absl::IsNotFound(watcher.status()) || (waited && absl::IsUnavailable(watcher.status()));
    if (!flags.wait || !absent) return watcher;
    if (!progress) progress.emplace(ProgressOptions(flags));
    progress->Wait(Concat("waiting for the stream to start: ", OneLine(watcher.status())));
    if (!Sleep(backoff.NextPause())) return absl::CancelledError("interrupted");
  }
}

void PrintSummary(const Summary& summary, const Ended& ended, double seconds) {
  if (summary.frame_count() == 0) return;
  std::fputs(summary.Table(seconds).c_str(), stdout);
  std::fputs(Concat("dropped frames: ", ended.dropped, "\n").c_str(), stdout);
  if (ended.gaps > 0) {
    std::fputs(Concat("missed during ", ended.gaps, " reconnections: at most ",
                      Plural(ended.in_gaps, "frame"), "\n")
                   .c_str(),
               stdout);
  }
}

}  // namespace

CLI::App* AddWatch(CLI::App& app, WatchFlags& flags) {
  CLI::App* verb = app.add_subcommand("watch", "Follow a stream of another producer while it runs");
  verb->add_option("STREAM", flags.stream, "Stream name, as listed by `partiemc streams`")
      ->required();
  AddServerFlags(*verb, flags.server, "Server")
      ->description(
          "Server address, HOST:PORT or unix:PATH. Give several if the stream may be on any of "
          "them")
      ->multi_option_policy(CLI::MultiOptionPolicy::Join)
      ->delimiter(',');
  auto* const mode =
      verb->add_option(
              "--mode", flags.mode,
              "latest: receive the newest frame, drop and count the others; every: receive all "
              "frames, disconnected if too slow")
          ->check(CLI::IsMember({"latest", "every"}))
          ->type_name("MODE")
          ->capture_default_str();
  verb->add_option("--from", flags.from,
                   "Begin with frame N, counted from 1, or with the oldest frame in the history of "
                   "the server")
      ->check([](const std::string& text) -> std::string {
        if (text == kOldest || ParseFrom(text)) return {};
        return "--from: " + text + "; must be a frame number or `oldest`";
      })
      ->type_name("N|oldest");
  verb->add_option("--frames", flags.frames, "Stop after N frames (default: when the stream ends)")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 62))
      ->type_name("N");
  auto* const max_error =
      verb->add_option("--max-error", flags.max_error,
                       "Receive surfaces with fewer triangles, whose root mean square error is at "
                       "most E spacings, in (0, 1]")
          ->check([](const std::string& text) -> std::string {
            const auto error = ParseNumber<double>(text);
            if (error && *error > 0 && *error <= 1) return {};
            return text + "; must be in (0, 1], in spacings";
          })
          ->type_name("E");
  verb->add_option("--max-triangles", flags.max_triangles,
                   "Receive surfaces with at most N triangles, or with error 0.35 if more are left")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 62))
      ->excludes(max_error)
      ->type_name("N");
  verb->add_option("--credits", flags.credits, "Number of frames in flight")
      ->check(CLI::Range(1, 64))
      ->type_name("N")
      ->capture_default_str();
  verb->add_option(
          "--give-up-after,--rejoin", flags.give_up_after_seconds,
          "How long to look for a lost stream, at every server, in seconds; 0: do not look")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  verb->add_option("--deadline", flags.deadline_seconds,
                   "Timeout for opening the watch, in seconds")
      ->check(CLI::Range(0.001, 86400.0))
      ->capture_default_str();
  auto* const output_dir =
      verb->add_option(
              "--output-dir", flags.files.output_dir,
              "Write DIR/frame_000000.EXT for every frame, with the numbers of the producer")
          ->type_name("DIR");
  verb->add_option("--format", flags.files.format,
                   "Formats of these files, from " + Names(AllFrameFormats()) +
                       " (default: geojson; for streams of surfaces ply)")
      ->needs(output_dir)
      ->type_name("LIST");
  verb->add_option(
          "--color-by", flags.files.color_by,
          "Attribute of the stream that colours the pictures of svg; a vector by its length")
      ->type_name("NAME")
      ->needs(output_dir);
  AddCompressGlbFlag(*verb, flags.files.compress_glb);
  AddStatisticsFlags(*verb, flags.files, "Options");
  verb->add_option("--record", flags.record,
                   "Record the particles that the producer sends to watchers (its "
                   "--echo-particles); a replay "
                   "of FILE.pemc has the same bits. "
                   "Sets --mode every and, unless --from is given, --from oldest")
      ->type_name("FILE");
  verb->add_flag("--wait", flags.wait,
                 "Wait for the stream to start, until Ctrl-C. With --mode every, begins with the "
                 "oldest frame unless --from is given");
  verb->add_flag("--quiet", flags.quiet, "No progress and no table");
  verb->footer(
      "A watcher never slows the stream. A watcher that joins late receives the newest frame at\n"
      "once, or with --from the history of the server (its --history-bytes). After a lost\n"
      "connection, --mode every and --from continue with the next frame.\n"
      "With --max-error or --max-triangles areas, volumes and digests are of the exact surfaces.\n"
      "Examples:\n"
      "  partiemc streams --server simulator:50051\n"
      "  partiemc watch dam-break --server simulator:50051\n"
      "  partiemc watch dam-break --mode every --output-dir out --format geojson,svg\n"
      "  partiemc watch dam-break --from oldest --mode every --stats dam.csv\n"
      "  partiemc watch dam-break --frames 1 --quiet --output-dir now\n"
      "  partiemc watch dam-break --wait --record dam.pemc\n"
      "  partiemc watch tank --max-triangles 20000 --output-dir out\n"
      "Exit codes: 0 good, 1 failed, 2 wrong usage, 4 server or its stream, 130 interrupted.");
  verb->parse_complete_callback([&flags, mode] {
    CompleteRecording(flags, mode->count() > 0);
    CompleteFrom(flags);
  });
  return verb;
}

int Watch(const WatchFlags& flags) {
  CatchInterrupts();  // Before the first temporary file exists.
  FrameOutputs::Places places = flags.files;
  // Checks the flags now, because waiting for the stream may take long.
  if (const absl::Status right = FrameOutputs::Check(places); !right.ok()) {
    return Complain(kUsage, right);
  }
  std::optional<Progress> progress;
  const auto watcher = OpenOrWait(flags, progress);
  if (!watcher.ok()) {
    progress.reset();  // Ends its line.
    if (absl::IsCancelled(watcher.status())) return Complain(kInterrupted, watcher.status());
    return ComplainOfServer(watcher.status());
  }
  places.surface = (*watcher)->stream().parameters.output == Output::kSurface;
  const ReconstructionParameters& parameters = (*watcher)->stream().parameters;
  places.sections = !parameters.sections.empty();
  places.walls = !parameters.walls.empty() || !parameters.wall_phases.empty();
  auto outputs = FrameOutputs::Create(places);
  if (!outputs.ok()) {
    progress.reset();
    const bool wrong_flag = outputs.status().code() == absl::StatusCode::kInvalidArgument;
    return Complain(wrong_flag ? kUsage : kFailed, outputs.status());
  }
  std::optional<StreamRecorder> recorder;
  if (!flags.record.empty()) {
    auto created = StreamRecorder::Create(flags.record, flags.stream, (*watcher)->stream());
    if (!created.ok()) return Complain(kFailed, created.status());
    recorder = *std::move(created);
  }

  if (!progress) progress.emplace(ProgressOptions(flags));
  const auto from = ParseFrom(flags.from);
  const auto& held = (*watcher)->stream().held;
  if (from && held && held->oldest_sequence > *from) {
    progress->Note(Concat("partiemc: frames before ", held->oldest_sequence,
                          " are no longer in the history; begins there"));
  }
  const Clock::time_point start = Clock::now();
  const Ended ended = ReceiveAll(flags, **watcher, *outputs, recorder, *progress);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  progress->Finish();

  absl::Status finished = outputs->Finish();
  if (finished.ok() && recorder) finished = recorder->Finish();
  if (!finished.ok()) return Complain(kFailed, finished);
  if (!flags.quiet) PrintSummary(outputs->summary(), ended, seconds);
  if (!flags.quiet && recorder) std::fputs(recorder->Summary().c_str(), stdout);
  return ended.word.empty() ? ended.code : Complain(ended.code, ended.word);
}

}  // namespace partiemc::client
