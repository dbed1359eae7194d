#include "client/python/watch.h"

#include <pybind11/stl.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "client/python/arguments.h"
#include "client/python/errors.h"
#include "client/python/parameters.h"
#include "client/python/results.h"
#include "client/python/waiting.h"
#include "partiemc/client/watcher.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;
using client::Received;
using std::chrono::milliseconds;

class Watch {
 public:
  Watch(const py::object& given_address, const py::object& given_name, const py::dict& given) {
    const auto address = AsOptional<std::string>(given_address, "address");
    const auto name = As<std::string>(given_name, "name");
    Arguments arguments(given);
    const client::WatcherOptions options = TakeWatcherOptions(arguments);
    arguments.ExpectNothingElse("watch");
    absl::StatusOr<std::unique_ptr<client::Watcher>> watcher = nullptr;
    {
      const py::gil_scoped_release others_may_run;
      watcher = client::Watcher::Open(AddressOf(address), name, options);
    }
    RaiseUnlessOk(watcher.status());
    watcher_ = *std::move(watcher);
  }
  ~Watch() {
    const py::gil_scoped_release others_may_run;
    watcher_.reset();
  }

  // Returns null (None) if no frame arrives in time. Raises EOFError at the end of the watch.
  std::shared_ptr<PythonResult> Receive(const py::object& given_wait) {
    const auto wait = AsOptional<double>(given_wait, "wait");
    const auto result = results_->Take();
    client::WatchedFrame frame;
    frame.frame = std::move(result->frame);
    const auto received = Wait(wait, [&](milliseconds slice) -> absl::StatusOr<Received> {
      const std::unique_lock lock(receiving_, slice);
      if (!lock.owns_lock()) return Received::kNothingYet;
      return watcher_->Receive(frame, slice);
    });
    result->frame = std::move(frame.frame);  // Returns unused buffers.
    RaiseUnlessOk(received.status());
    if (*received == Received::kNothingYet) return nullptr;
    if (*received == Received::kEnd) {
      PyErr_SetString(PyExc_EOFError,
                      (watcher_->end().reason + ": " + watcher_->end().message).c_str());
      throw py::error_already_set();
    }
    result->sequence = frame.sequence;
    result->time = frame.time;
    result->in_space = watcher_->stream().parameters.output == Output::kSurface;
    result->level = frame.level;
    result->particles = std::move(frame.particles);
    result->particle_attributes = std::move(frame.particle_attributes);
    result->particle_box = frame.particle_box;
    result->dropped = frame.dropped;
    result->gap = frame.gap;
    result->rejoined = std::move(frame.rejoined);
    WarnOfDoubts(result, warned_);
    return result;
  }

  std::shared_ptr<PythonResult> Next() {
    return NextBy([this] { return Receive(py::none()); });
  }

  void Cancel() {
    const py::gil_scoped_release others_may_run;
    watcher_->Cancel();
  }
  py::dict Parameters() const { return ToDict(watcher_->stream().parameters); }
  std::string End() const { return watcher_->end().reason; }

 private:
  const std::shared_ptr<ResultPool> results_ = std::make_shared<ResultPool>();
  std::unique_ptr<client::Watcher> watcher_;
  Doubts warned_;               // Guarded by the GIL.
  std::timed_mutex receiving_;  // Held by the receiving thread.
};

}  // namespace

void DefineWatch(py::module_& module) {
  using namespace py::literals;
  module.attr("watch_options") = NamesTakenBy(&TakeWatcherOptions);
  py::class_<Watch>(
      module, "Watch",
      "An iterator over the results of another producer's stream, opened by partiemc.watch.")
      .def(py::init<const py::object&, const py::object&, const py::dict&>())
      .def(
          "receive", &Watch::Receive, "wait"_a = py::none(),
          "The next Result; None if no frame arrives within `wait` seconds. Raises EOFError at the "
          "end of the stream, partiemc.Error if the watch was lost.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Watch::Next)
      .def("cancel", &Watch::Cancel, "Ends the watch at once, from any thread.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Watch& watch, const py::args&) { watch.Cancel(); })
      .def_property_readonly("parameters", &Watch::Parameters, "Parameters of the stream by name.")
      .def_property_readonly("end", &Watch::End,
                             "Reason of the end: 'FINISHED', 'PRODUCER_LOST', ...");
}

}  // namespace partiemc::python
