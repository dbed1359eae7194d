// Frames through a real server: sent, reconstructed in another process, answered, decoded.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "bench/scenes.h"
#include "bench/server_process.h"
#include "partiemc/client/stream.h"

namespace partiemc::bench {

/// One stream to a server, frame after frame of a scene.
class FrameExchange {
 public:
  /// Opens the stream, plays some frames to warm both sides up, and compares the first of them with
  /// what the core gives in this process, bit for bit. Ends the program where they differ.
  FrameExchange(const ServerProcess& server, const Scene& scene);

  /// Wall-clock time of one frame as the warm-up saw it.
  double warm_frame_ms() const { return warm_frame_ms_; }

  /// What a series of frames took.
  struct Series {
    double frame_ms = 0;             ///< From the first answer to the last, per frame.
    std::vector<double> latency_ms;  ///< By frame: from before it is sent until it is decoded.
  };
  /// Plays `frames` frames, at least two, at most `in_flight` of them under way at once;
  /// `answered` is called with the number of answers after each.
  Series Play(int frames, int in_flight, const std::function<void(int)>& answered = {});

 private:
  void CheckAgainstCore();

  const Scene& scene_;
  std::unique_ptr<client::Stream> stream_;
  client::Event event_;
  std::size_t next_ = 0;
  double warm_frame_ms_ = 0;
};

/// How long to measure: `runs` series of about `run_ms`, of at least `min_frames` each.
struct EndToEndPlan {
  int runs = 5;
  double run_ms = 500;
  int min_frames = 12;
};

struct EndToEnd {
  double frame_ms = 0;       ///< Median over runs, steady state, and so are the next two.
  double client_cpu_ms = 0;  ///< Per frame.
  double server_cpu_ms = 0;
  double p50_ms = 0, p90_ms = 0, p99_ms = 0;  ///< Of the latencies of all frames of all runs.
  int frames = 0;
};
EndToEnd MeasureEndToEnd(const ServerProcess& server, const Scene& scene, int in_flight,
                         const EndToEndPlan& plan);

}  // namespace partiemc::bench
