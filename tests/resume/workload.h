// Sequences of frames of any length for tests.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
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

  const Particles& at(std::uint64_t index) const { return frames[index % frames.size()]; }
};

/// The bundled dam break: 75 frames of 2D SPH.
Workload DamBreak();
/// A drifting disc with a hole and spray; every eleventh frame is refused.
Workload Blob();
/// A body and a drop that leaps over it; only ids distinguish them.
Workload Leap();

/// Sends frames, at most `per_second` (0: no limit), until `enough` returns true for the number
/// sent; receives concurrently until the stream ends.
History RunThrough(client::FrameStream& stream, const Workload& workload, double per_second,
                   const std::function<bool(std::uint64_t)>& enough);

/// The same frames through the core in this process.
History RunUndisturbed(const Workload& workload, std::uint64_t frames);

}  // namespace partiemc::resume
