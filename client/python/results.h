// What a frame became, as Python sees it: arrays that are views and keep their result.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "partiemc/client/frame_stream.h"

namespace partiemc::python {

/// A result, which never changes once Python has it.
struct PythonResult {
  std::uint64_t sequence = 0;
  double time = 0;
  client::FrameResult frame;
  /// Of `frame`; where they are not known yet, they are computed when somebody wants them.
  bool has_digests = true;
  // Of watched frames:
  std::vector<double> particles;
  std::uint64_t dropped = 0, gap = 0;
  std::string rejoined;
  /// Those of `frame`, once somebody has asked for them: they have taken its results then.
  std::vector<std::shared_ptr<PythonResult>> sections;
};

/// Results whose buffers are used again once Python has let them go. Safe to share between threads.
class ResultPool : public std::enable_shared_from_this<ResultPool> {
 public:
  std::shared_ptr<PythonResult> Take();

 private:
  static constexpr std::size_t kMostKept = 2;

  std::mutex mutex_;
  std::vector<client::FrameResult> kept_;
};

void DefineResults(pybind11::module_& module);

}  // namespace partiemc::python
