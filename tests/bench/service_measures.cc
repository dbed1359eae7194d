#include "bench/service_measures.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "bench/end_to_end.h"
#include "bench/progress.h"
#include "bench/statistics.h"

namespace partiemc::bench {
namespace {

std::string Name(Transport transport) { return transport == Transport::kTcp ? "tcp" : "unix"; }

// "end_to_end_ms_1m" is the reference: two in flight over TCP. Others say what they are.
std::string Suffix(const Scene& scene, Transport transport, int in_flight) {
  if (transport == Transport::kTcp && in_flight == 2) return scene.name;
  return absl::StrCat(scene.name, "_", Name(transport), "_", in_flight);
}

// Memory of a server while it serves one stream.
struct ServerMemory {
  double early_mb = 0, late_mb = 0;  ///< Resident: medians over the first and the last tenth.
  double peak_mb = 0;
};

ServerMemory PlayAndWatch(const Scene& scene, int frames) {
  // What is held for watchers comes on top of it, as much as the server is told.
  const ServerProcess server(Transport::kTcp, {"--history-bytes", "0"});
  FrameExchange exchange(server, scene);
  // A moment tells little: a frame or two may be on their way just then, or none.
  const int tenth = std::max(frames / 10, 1), step = std::max(frames / 100, 1);
  std::vector<double> early, late;
  exchange.Play(frames, 2, [&](int answered) {
    if (answered % step != 0) return;
    if (answered <= tenth) early.push_back(server.ResidentMb());
    if (answered > frames - tenth) late.push_back(server.ResidentMb());
  });
  return {.early_mb = Median(early), .late_mb = Median(late), .peak_mb = server.PeakMb()};
}

}  // namespace

void MeasureEndToEnd(const ReferenceScenes& scenes, bool quick, Report& report) {
  report.AddHeading("End to end");
  report.AddParagraph(
      "A frame sent by the client library to a server process, reconstructed, answered with rings, "
      "mesh and statistics, decoded. \"A frame\" is the time from answer to answer in steady "
      "state; "
      "latencies run from before sending to after decoding, frames that wait for others included. "
      "Processor milliseconds are those of client and server. The bound is the in-process time on "
      "all processors, plus what moving the bytes costs.");
  std::vector<Report::Row> rows = {{"scene", "transport", "in flight", "a frame ms", "frames/s",
                                    "p50 ms", "p90 ms", "p99 ms", "client ms", "server ms",
                                    "frames"}};
  const EndToEndPlan plan =
      quick ? EndToEndPlan{.runs = 3, .run_ms = 400, .min_frames = 4} : EndToEndPlan{};
  for (const Transport transport : {Transport::kTcp, Transport::kUnix}) {
    const ServerProcess server(transport);
    for (const Scene* scene :
         {&scenes.blob_10k, &scenes.blob_100k, &scenes.blob_1m, &scenes.dam_break}) {
      if (quick && transport == Transport::kUnix && scene == &scenes.blob_1m) continue;
      for (const int in_flight : quick ? std::vector<int>{2} : std::vector<int>{1, 2, 4}) {
        Progress(absl::StrCat("end to end: ", scene->name, ", ", Name(transport), ", ", in_flight,
                              " in flight"));
        const EndToEnd found = MeasureEndToEnd(server, *scene, in_flight, plan);
        const std::string suffix = Suffix(*scene, transport, in_flight);
        report.AddMetric("end_to_end_ms_" + suffix, found.frame_ms, "ms");
        report.AddMetric("end_to_end_p50_ms_" + suffix, found.p50_ms, "ms");
        report.AddMetric("end_to_end_p90_ms_" + suffix, found.p90_ms, "ms");
        report.AddMetric("end_to_end_p99_ms_" + suffix, found.p99_ms, "ms");
        report.AddMetric("end_to_end_client_cpu_ms_" + suffix, found.client_cpu_ms, "ms");
        report.AddMetric("end_to_end_server_cpu_ms_" + suffix, found.server_cpu_ms, "ms");
        rows.push_back({scene->name, Name(transport), absl::StrCat(in_flight),
                        Figure(found.frame_ms), Figure(1000 / found.frame_ms), Figure(found.p50_ms),
                        Figure(found.p90_ms), Figure(found.p99_ms), Figure(found.client_cpu_ms),
                        Figure(found.server_cpu_ms), absl::StrCat(found.frames)});
      }
    }
  }
  report.AddTable(rows);
  const double processor_ms =
      report.Metric("end_to_end_client_cpu_ms_1m") + report.Metric("end_to_end_server_cpu_ms_1m");
  report.AddMetric("end_to_end_cpu_over_compute_1m",
                   processor_ms / report.Metric("compute_cpu_ms_1m"), "ratio");
}

void MeasureServerMemory(const ReferenceScenes& scenes, bool quick, Report& report) {
  struct Watched {
    const Scene* scene;
    int frames;
  };
  // Six frames have seen the peak; whether it stays takes a thousand.
  const std::vector<Watched> plan = {{&scenes.blob_10k, 1000}, {&scenes.blob_1m, quick ? 6 : 1000}};
  std::vector<Report::Row> rows = {
      {"scene", "frames", "first tenth MB", "last tenth MB", "peak MB", "growth MB"}};
  for (const auto& [scene, frames] : plan) {
    Progress(absl::StrCat("memory of a server over ", frames, " frames of ", scene->name));
    const ServerMemory seen = PlayAndWatch(*scene, frames);
    const double growth = seen.late_mb - seen.early_mb;
    report.AddMetric("server_peak_mb_" + scene->name, seen.peak_mb, "MB");
    report.AddMetric("server_resident_mb_" + scene->name, seen.late_mb, "MB");
    if (frames >= 100) {
      report.AddMetric("server_growth_mb_" + scene->name, growth, "MB");
      report.AddMetric("server_end_over_early_memory_" + scene->name, seen.late_mb / seen.early_mb,
                       "ratio");
    }
    rows.push_back({scene->name, absl::StrCat(frames), Figure(seen.early_mb), Figure(seen.late_mb),
                    Figure(seen.peak_mb), Figure(growth)});
  }
  report.AddMetric(
      "server_peak_over_frame_1m",
      1e6 * report.Metric("server_peak_mb_1m") / static_cast<double>(scenes.blob_1m.FrameBytes()),
      "ratio");
  report.AddHeading("Memory");
  report.AddParagraph(absl::StrCat(
      "Peak of a server process that has served one stream of a million particles, two frames in "
      "flight: ",
      Figure(report.Metric("server_peak_mb_1m")), " MB; a frame's positions are ",
      Figure(static_cast<double>(scenes.blob_1m.FrameBytes()) / 1e6),
      " MB, of which the server holds as many as are in flight. Resident memory over many frames "
      "of one stream, which should not grow:"));
  report.AddTable(rows);
  report.AddParagraph(
      absl::StrCat("Allocations of the core in a warm frame of 100k on two threads: ",
                   Figure(report.Metric("allocations_per_warm_frame")), " (",
                   Figure(report.Metric("allocated_bytes_per_warm_frame")), " bytes), and ",
                   Figure(report.Metric("tbb_allocations_per_warm_frame")),
                   " of oneTBB's own. The bound is 0."));
}

}  // namespace partiemc::bench
