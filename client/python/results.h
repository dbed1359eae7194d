// Results for Python: arrays are views that keep their result alive.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/mutex.h"
#include "partiemc/client/frame_stream.h"
#include "partiemc/doubt.h"
#include "partiemc/parameters.h"
#include "partiemc/surface_level.h"

namespace partiemc::python {

/// A result. Constant once Python holds it, except for digests and sections (filled later).
struct PythonResult {
  std::uint64_t sequence = 0;
  double time = 0;
  client::FrameResult frame;
  bool has_digests = true;  ///< False: the first access computes the digests.
  /// True if the output of the stream is surfaces: `particles` then has three coordinates each.
  bool in_space = false;
  // As in client::WatchedFrame, for watched frames only:
  std::optional<SurfaceLevel> level;
  std::vector<double> particles;
  std::vector<AttributeValues> particle_attributes;
  std::optional<PeriodicBox> particle_box;
  std::uint64_t dropped = 0, gap = 0;
  std::string rejoined;
  /// Sections as Python objects. The first access moves them here from `frame`.
  std::vector<std::shared_ptr<PythonResult>> sections;
};

/// Number of coordinates of each of the result's particles.
std::size_t CoordinatesOf(const PythonResult& result);

/// The additional outlines of the frame. The first call moves them out of `result.frame`.
const std::vector<std::shared_ptr<PythonResult>>& SectionsOf(PythonResult& result);

/// Reuses the buffers of results that Python has released. Thread-safe.
class ResultPool : public std::enable_shared_from_this<ResultPool> {
 public:
  std::shared_ptr<PythonResult> Take() ABSL_LOCKS_EXCLUDED(mutex_);

 private:
  static constexpr std::size_t kMostKept = 2;

  Mutex mutex_;
  std::vector<client::FrameResult> kept_ ABSL_GUARDED_BY(mutex_);
};

/// Issues a PartiemcWarning for each doubt of the result that is not yet in `warned`, and adds the
/// doubt to `warned`. Requires the GIL. If Python turns warnings into errors, throws; the exception
/// then carries the result.
void WarnOfDoubts(const std::shared_ptr<PythonResult>& result, Doubts& warned);

void DefineResults(pybind11::module_& module);

}  // namespace partiemc::python
