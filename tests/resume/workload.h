// Sequences of frames of any length for tests.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "partiemc/client/frame_stream.h"
#include "partiemc/parameters.h"
#include "resume/history.h"

namespace partiemc::resume {

/// Frame `index`, from 0; the sequence repeats.
struct Workload {
  struct Particles {
    std::vector<double> positions;
    std::vector<std::uint64_t> ids;
    bool is_bad = false;  ///< The server refuses it.
  };

  std::string name;
  ReconstructionParameters parameters;
  std::vector<Particles> frames;
  int components = 2;  ///< Of a position.

  /// Frame `index` at `time`. Valid while this object exists.
  Frame FrameAt(std::uint64_t index, double time) const {
    const Particles& particles = at(index);
    return {.positions = std::span<const double>(particles.positions),
            .components = components,
            .ids = particles.ids,
            .time = time};
  }

  const Particles& at(std::uint64_t index) const { return frames[index % frames.size()]; }
};

/// The bundled dam break: 75 frames of 2D SPH.
Workload DamBreak();
/// A drifting disc with a hole and spray; every eleventh frame is refused.
Workload Blob();
/// A body and a drop that leaps over it; only ids distinguish them.
Workload Leap();

/// Surfaces: two balls in space that merge, with an outline on a plane.
Workload Merge();

/// The answer of a result or refusal, without the time of its arrival.
Answer AnswerOf(const client::Event& event);

/// Sends frames, at most `per_second` (0: no limit), until `enough` returns true for the number
/// sent; receives concurrently until the stream ends.
History RunThrough(client::FrameStream& stream, const Workload& workload, double per_second,
                   const std::function<bool(std::uint64_t)>& enough);

/// The same frames through the core in this process.
History RunUndisturbed(const Workload& workload, std::uint64_t frames);

}  // namespace partiemc::resume
