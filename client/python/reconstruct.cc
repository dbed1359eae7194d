#include "client/python/reconstruct.h"

#include <pybind11/stl.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "client/library/gather.h"
#include "client/library/owned_frame.h"
#include "client/python/arguments.h"
#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "client/python/parameters.h"
#include "client/python/research.h"
#include "client/python/results.h"
#include "common/mutex.h"
#include "common/stage_clock.h"
#include "partiemc/arena.h"
#include "partiemc/reconstructor.h"
#include "partiemc/spacing.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;

// The keyword arguments of a Reconstructor.
struct SequenceOptions {
  unsigned threads = 0;  // 0: one per processor.
  VirtualPlaneVariant variant;
  ReconstructionParameters parameters;
};

SequenceOptions TakeSequenceOptions(Arguments& arguments) {
  SequenceOptions options;
  arguments.TakeInto("threads", options.threads);
  options.variant = TakeResearch(arguments);
  options.parameters = TakeParameters(arguments);
  return options;
}

// Implements partiemc.Reconstructor. Any thread may call it; calls run one after another.
class Sequence {
 public:
  explicit Sequence(Arguments arguments) {
    const SequenceOptions options = TakeSequenceOptions(arguments);
    auto reconstructor = CreateVariant(options.parameters, options.variant);
    arguments.ExpectNothingElse("reconstruct");
    RaiseUnlessOk(reconstructor.status());
    reconstructor_ = *std::move(reconstructor);
    if (options.threads > 0) arena_ = std::make_unique<Arena>(options.threads);
  }

  std::shared_ptr<PythonResult> Reconstruct(const py::object& positions,
                                            const py::object& given_time, const py::object& volumes,
                                            const py::object& ids, const py::object& velocities,
                                            const py::object& attributes, const py::object& box) {
    const auto time = AsOptional<double>(given_time, "time");
    const PythonParticles particles(positions, volumes, ids, velocities, attributes, box);
    const auto result = results_->Take();
    absl::Status status;
    {
      const py::gil_scoped_release others_may_run;
      const MutexLock lock(mutex_);
      status = Compute(particles.arrays(), time, *result);
    }
    RaiseUnlessOk(status);
    WarnOfDoubts(result, warned_);
    return result;
  }

  void Reset() {
    const py::gil_scoped_release others_may_run;
    const MutexLock lock(mutex_);
    state_ = {};
    frames_ = 0;
  }

  py::dict parameters() const { return ToDict(reconstructor_->parameters()); }

 private:
  absl::Status Compute(const client::ParticleArrays& particles, std::optional<double> time,
                       PythonResult& result) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    result.time = time.value_or(static_cast<double>(frames_));
    const auto rows = client::RowsOf(particles, result.time);
    if (!rows.ok()) return rows.status();
    gathered_.Adopt(*rows);
    StageClock clock;
    absl::Status status;
    const auto compute = [&] {
      mutex_.AssertHeld();
      status = reconstructor_->Reconstruct(gathered_.frame(), state_, workspace_,
                                           result.frame.result, {.observer = &clock});
    };
    if (arena_ != nullptr) {
      arena_->Execute(compute);
    } else {
      compute();
    }
    result.frame.times = {.stages_ms = clock.stages_ms(), .total_ms = clock.TotalMs()};
    result.has_digests = false;
    result.in_space = reconstructor_->parameters().output == Output::kSurface;
    if (status.ok()) result.sequence = ++frames_;
    return status;
  }

  const std::shared_ptr<ResultPool> results_ = std::make_shared<ResultPool>();
  std::optional<Reconstructor> reconstructor_;
  std::unique_ptr<Arena> arena_;  // Null: one thread per processor.
  Doubts warned_;                 // Guarded by the GIL.

  Mutex mutex_;
  State state_ ABSL_GUARDED_BY(mutex_);
  Workspace workspace_ ABSL_GUARDED_BY(mutex_);
  client::OwnedFrame gathered_ ABSL_GUARDED_BY(mutex_);
  std::uint64_t frames_ ABSL_GUARDED_BY(mutex_) = 0;
};

std::optional<double> EstimatedSpacing(const py::object& positions) {
  const PythonParticles particles(positions, py::none(), py::none(), py::none(), py::none());
  const py::gil_scoped_release others_may_run;
  const auto rows = client::RowsOf(particles.arrays(), 0);
  absl::Status status = rows.status();
  std::optional<double> spacing;
  if (rows.ok()) {
    client::OwnedFrame gathered;
    gathered.Adopt(*rows);
    spacing = EstimateSpacing(gathered.frame());
  }
  const py::gil_scoped_acquire with_python;
  RaiseUnlessOk(status);
  return spacing;
}

}  // namespace

void DefineReconstructor(py::module_& module) {
  using namespace py::literals;
  module.def("estimate_spacing", &EstimatedSpacing, "positions"_a,
             "The spacing of particles, world units: from the density inside of bodies, within "
             "3 percent; in thin sheets the median distance to the nearest neighbour. Positions "
             "(N, 3) fill space. None if no two particles differ.");
  module.attr("reconstructor_options") =
      NamesTakenBy([](Arguments& none) { TakeSequenceOptions(none); });
  py::class_<Sequence>(module, "Reconstructor",
                       "Reconstructs the frames of one simulation in this process. Outlines are "
                       "steady and rings are tracked, as in a stream.")
      .def(py::init([](const py::kwargs& arguments) {
             return std::make_unique<Sequence>(Arguments(arguments));
           }),
           "Reconstructor(*, spacing=None, threads=None, placement='virtual-plane', "
           "fill='greedy', ...): see partiemc.reconstruct.")
      .def("reconstruct", &Sequence::Reconstruct, "positions"_a, "time"_a = py::none(),
           py::kw_only(), "volumes"_a = py::none(), "ids"_a = py::none(),
           "velocities"_a = py::none(), "attributes"_a = py::none(), "box"_a = py::none(),
           "Reconstructs the next frame; `time` defaults to the number of earlier frames. `box` is "
           "the periodic box of this frame, with the axes of the parameter `box`. See "
           "partiemc.reconstruct for the arrays. Raises partiemc.Error; a refused frame changes "
           "nothing.")
      .def("reset", &Sequence::Reset, "Discards the state of earlier frames.")
      .def_property_readonly("parameters", &Sequence::parameters,
                             "Resolved parameters by name; a spacing of None is estimated.");
}

}  // namespace partiemc::python
