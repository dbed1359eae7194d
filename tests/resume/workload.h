// Sequences of frames that tests stream, for as long as they like.
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

/// Frame `index`, from 0; it begins again when it is through.
struct Workload {
  struct Particles {
    std::vector<double> positions;
    std::vector<std::uint64_t> ids;
    bool is_bad = false;  ///< The server will refuse it.
  };

  std::string name;
  ReconstructionParameters parameters;
  std::vector<Particles> frames;

  const Particles& at(std::uint64_t index) const { return frames[index % frames.size()]; }
};

/// The bundled dam break: 75 frames of 2D SPH.
Workload DamBreak();
/// A drifting disc with a hole and spray; every eleventh frame is one that is refused.
Workload Blob();
/// A body and a drop that leaps over it, told apart by ids alone.
Workload Leap();

/// Sends frames, `per_second` at most (0: as fast as it goes), until `enough` is true of the number
/// sent, and receives beside it until the stream ends.
History RunThrough(client::FrameStream& stream, const Workload& workload, double per_second,
                   const std::function<bool(std::uint64_t)>& enough);

/// The same frames through the core in this process.
History RunUndisturbed(const Workload& workload, std::uint64_t frames);

}  // namespace partiemc::resume
