#include "bench/end_to_end.h"

#include <algorithm>
#include <atomic>
#include <semaphore>
#include <string>
#include <thread>

#include "bench/clocks.h"
#include "bench/core_stream.h"
#include "bench/progress.h"
#include "bench/statistics.h"

namespace partiemc::bench {
namespace {

constexpr int kWarmUpFrames = 4;
constexpr int kComparedFrames = 2;
constexpr int kMostFramesOfARun = 2000;

// The next answer, which must be a result.
void ReceiveResult(client::Stream& stream, client::Event& event) {
  do {
    if (Require(stream.Receive(event)) != client::Received::kEvent) Fail("the stream has ended");
  } while (event.kind == client::Event::Kind::kNotice);
  if (event.kind == client::Event::Kind::kRefusal) Fail("a frame was refused: " + event.message);
}

}  // namespace

FrameExchange::FrameExchange(const ServerProcess& server, const Scene& scene)
    : scene_(scene),
      stream_(Require(
          client::Stream::Open(server.address(), {.parameters = ReferenceParameters(scene)}))) {
  CheckAgainstCore();
  warm_frame_ms_ = Play(kWarmUpFrames, 2).frame_ms;
}

void FrameExchange::CheckAgainstCore() {
  CoreStream core(scene_, ReferenceParameters(scene_));
  for (; next_ < kComparedFrames; ++next_) {
    Require(stream_->Send(scene_.At(next_), static_cast<double>(next_)).status());
    ReceiveResult(*stream_, event_);
    core.Next();
    if (event_.frame.rings_digest != DigestRings(core.result().rings) ||
        event_.frame.mesh_digest != DigestMesh(core.result().mesh)) {
      Fail("frame " + std::to_string(next_) + " of " + scene_.name +
           " differs between server and core");
    }
  }
}

FrameExchange::Series FrameExchange::Play(int frames, int in_flight,
                                          const std::function<void(int)>& answered) {
  Series series;
  series.latency_ms.resize(frames);  // Until its answer has come: when the frame was sent.
  std::counting_semaphore<> window(in_flight);
  std::atomic<bool> stopped = false;
  absl::Status sent = absl::OkStatus();
  std::thread sender([&] {
    for (int k = 0; k < frames && sent.ok(); ++k) {
      window.acquire();
      if (stopped) return;
      series.latency_ms[k] = WallMs();
      const std::size_t index = next_ + k;
      sent = stream_->Send(scene_.At(index), static_cast<double>(index)).status();
    }
    if (!sent.ok()) stream_->Cancel();
  });
  double first = 0, last = 0;
  try {
    for (int k = 0; k < frames; ++k) {
      ReceiveResult(*stream_, event_);
      last = WallMs();
      if (k == 0) first = last;
      // Written by the sender before it sent what has just been answered.
      series.latency_ms[k] = last - series.latency_ms[k];
      window.release();
      if (answered) answered(k + 1);
    }
  } catch (...) {
    stopped = true;
    window.release();
    stream_->Cancel();
    sender.join();
    Require(sent);  // The cause, where it is the sender's.
    throw;
  }
  sender.join();
  next_ += frames;
  series.frame_ms = (last - first) / (frames - 1);
  return series;
}

EndToEnd MeasureEndToEnd(const ServerProcess& server, const Scene& scene, int in_flight,
                         const EndToEndPlan& plan) {
  FrameExchange exchange(server, scene);
  const int frames = std::clamp(static_cast<int>(plan.run_ms / exchange.warm_frame_ms()),
                                plan.min_frames, kMostFramesOfARun);
  std::vector<double> frame_ms, client_cpu_ms, server_cpu_ms, latency_ms;
  for (int run = 0; run < plan.runs; ++run) {
    const double client_begin = Cost::Now().cpu_ms, server_begin = server.CpuMs();
    const FrameExchange::Series series = exchange.Play(frames, in_flight);
    client_cpu_ms.push_back((Cost::Now().cpu_ms - client_begin) / frames);
    server_cpu_ms.push_back((server.CpuMs() - server_begin) / frames);
    frame_ms.push_back(series.frame_ms);
    latency_ms.insert(latency_ms.end(), series.latency_ms.begin(), series.latency_ms.end());
  }
  return {.frame_ms = Median(frame_ms),
          .client_cpu_ms = Median(client_cpu_ms),
          .server_cpu_ms = Median(server_cpu_ms),
          .p50_ms = Percentile(latency_ms, 50),
          .p90_ms = Percentile(latency_ms, 90),
          .p99_ms = Percentile(latency_ms, 99),
          .frames = plan.runs * frames};
}

}  // namespace partiemc::bench
