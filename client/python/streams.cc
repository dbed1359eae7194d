#include "client/python/streams.h"

#include <pybind11/stl.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/python/arguments.h"
#include "client/python/arrays.h"
#include "client/python/errors.h"
#include "client/python/parameters.h"
#include "client/python/results.h"
#include "client/python/waiting.h"
#include "common/mutex.h"
#include "partiemc/client/latest_sender.h"
#include "partiemc/client/server_info.h"
#include "partiemc/client/stream.h"
#include "partiemc/client/stream_list.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;
using client::Event;
using client::Received;
using std::chrono::milliseconds;

// Maximum time that `send` waits for another thread to receive for the first time, and its poll
// interval.
constexpr milliseconds kReceiverWait(500), kReceiverPoll(5);

// Maximum time to wait for the last frames of a stream that the program drops after `finish`. A
// healthy server needs far less. A lost server must not keep a program from ending.
constexpr std::chrono::seconds kDropWait(10);

[[noreturn]] void RaiseEnd() {
  PyErr_SetString(PyExc_EOFError, "the stream has ended: every frame has been answered");
  throw py::error_already_set();
}

class ProducerStream {
 public:
  ProducerStream(const py::object& given_address, const py::object& is_latest,
                 const py::dict& given) {
    const auto address = AsOptional<std::string>(given_address, "address");
    const bool latest = As<bool>(is_latest, "latest");
    Arguments arguments(given);
    const client::StreamOptions options = TakeStreamOptions(arguments, latest);
    arguments.ExpectNothingElse("connect");
    if (latest && options.parts.parts > 0) {
      throw py::value_error("latest: True; must be False where frames come in parts");
    }
    absl::StatusOr<std::unique_ptr<client::Stream>> stream = nullptr;
    {
      const py::gil_scoped_release others_may_run;
      stream = client::Stream::Open(AddressOf(address), options);
    }
    RaiseUnlessOk(stream.status());
    stream_ = *std::move(stream);
    if (latest) latest_ = std::make_unique<client::LatestSender>(*stream_);
  }
  ~ProducerStream() {
    const py::gil_scoped_release others_may_run;
    if (finished_) Drain(std::chrono::steady_clock::now() + kDropWait).IgnoreError();
    if (finisher_.joinable()) {
      stream_->Cancel();  // Ends `finisher_` if frames are left. Does nothing after the end.
      finisher_.join();
    }
    latest_.reset();
    stream_.reset();
  }

  std::optional<std::uint64_t> Send(const py::object& positions, const py::object& given_time,
                                    const py::object& volumes, const py::object& ids,
                                    const py::object& velocities, const py::object& attributes,
                                    const py::object& box) {
    const auto time = AsOptional<double>(given_time, "time");
    const PythonParticles particles(positions, volumes, ids, velocities, attributes, box);
    absl::StatusOr<std::uint64_t> sent = 0;
    {
      const py::gil_scoped_release others_may_run;
      const MutexLock lock(sending_);
      const double instant = time.value_or(static_cast<double>(frames_));
      if (latest_ != nullptr) {
        const absl::Status offered = Offer(particles.arrays(), instant);
        if (!offered.ok()) sent = offered;
      } else if (const absl::Status ready = ExpectReceiver(); !ready.ok()) {
        sent = ready;
      } else {
        sent = stream_->SendArrays(particles.arrays(), instant);
      }
      if (sent.ok()) ++frames_;
    }
    if (absl::IsUnavailable(sent.status())) has_raised_ = true;
    RaiseUnlessOk(sent.status());
    return latest_ != nullptr ? std::nullopt : std::optional(*sent);
  }

  // Returns null (None) if no event arrives in time, or if the event is the acceptance of a part.
  std::shared_ptr<PythonResult> Receive(const py::object& given_wait) {
    const auto wait = AsOptional<double>(given_wait, "wait");
    const auto result = results_->Take();
    const ReceiveMark mark(*this);
    for (;;) {
      Event event;
      event.frame = std::move(result->frame);
      const auto received = Wait(wait, [&](milliseconds slice) -> absl::StatusOr<Received> {
        const std::unique_lock lock(receiving_, slice);
        if (!lock.owns_lock()) return Received::kNothingYet;
        return stream_->Receive(event, slice);
      });
      result->frame = std::move(event.frame);  // Returns unused buffers.
      if (!received.ok()) has_raised_ = true;
      RaiseUnlessOk(received.status());
      if (*received == Received::kNothingYet) return nullptr;
      if (*received == Received::kEnd) RaiseEnd();
      if (event.kind == Event::Kind::kRefusal) {
        ++answered_;
        Raise(event.message, event.violation, event.sequence);
      }
      if (event.kind == Event::Kind::kPartTaken) return nullptr;
      if (event.kind != Event::Kind::kResult) continue;
      ++answered_;
      result->sequence = event.sequence;
      result->in_space = stream_->info().parameters.output == Output::kSurface;
      result->time = event.time;
      WarnOfDoubts(result, warned_);
      return result;
    }
  }

  std::shared_ptr<PythonResult> Next() {
    return NextBy([this] { return Receive(py::none()); });
  }

  void Finish() {
    absl::Status status;
    {
      const py::gil_scoped_release others_may_run;
      const MutexLock lock(sending_);
      if (std::exchange(finished_, true)) return;
      if (latest_ == nullptr) {
        status = stream_->FinishSending();
      } else {
        // `LatestSender::Finish` blocks until a thread receives. This may be the calling thread, so
        // Finish runs in another thread. `Receive` reports the error that ends the stream.
        finisher_ = std::thread([this] { static_cast<void>(latest_->Finish()); });
      }
    }
    RaiseUnlessOk(status);
  }

  // Finishes the stream. Receives and drops the results that are left, so that waiting frames are
  // still sent. Ctrl-C cancels the stream. Raises the error that ended the stream, unless Send
  // or Receive has raised it: frames may be lost.
  void Close() {
    std::packaged_task<absl::Status()> task([this] { return FinishAndDrain(); });
    std::future<absl::Status> closed = task.get_future();
    std::thread closer(std::move(task));
    bool is_interrupted = false;
    for (bool is_closed = false; !is_closed && !is_interrupted;) {
      {
        const py::gil_scoped_release others_may_run;
        is_closed = closed.wait_for(kSlice) == std::future_status::ready;
      }
      is_interrupted = PyErr_CheckSignals() != 0;
    }
    {
      const py::gil_scoped_release others_may_run;
      if (is_interrupted) stream_->Cancel();
      closer.join();
    }
    if (is_interrupted) throw py::error_already_set();
    const absl::Status end = closed.get();
    if (!has_raised_ && !absl::IsCancelled(end)) RaiseUnlessOk(end);
  }

  void Cancel() {
    const py::gil_scoped_release others_may_run;
    stream_->Cancel();
  }

  // The number of frames without an answer. With `latest` it includes frames that wait to be sent.
  std::uint64_t InFlight() const {
    if (latest_ == nullptr) return stream_->InFlight();
    const std::uint64_t answered = answered_;
    const client::OfferCounts counts = latest_->counts();
    return offered_ - answered - counts.skipped - counts.refused;
  }
  bool IsLatest() const { return latest_ != nullptr; }
  std::size_t Window() const { return stream_->info().frames_in_flight; }
  std::string Id() const { return stream_->CurrentId(); }
  py::dict Parameters() const { return ToDict(stream_->info().parameters); }
  py::dict Counts() const {
    const auto counts = latest_ != nullptr ? latest_->counts() : client::OfferCounts{};
    using namespace py::literals;
    return py::dict("sent"_a = counts.sent, "skipped"_a = counts.skipped,
                    "refused"_a = counts.refused);
  }

 private:
  // Marks the calling thread as the receiver.
  class ReceiveMark {
   public:
    explicit ReceiveMark(ProducerStream& stream) : stream_(stream) {
      stream_.last_receiver_ = std::this_thread::get_id();
      ++stream_.receives_;
    }
    ~ReceiveMark() { --stream_.receives_; }
    ReceiveMark(const ReceiveMark&) = delete;
    ReceiveMark& operator=(const ReceiveMark&) = delete;

   private:
    ProducerStream& stream_;
  };

  // Returns the error that ended the stream, or OK.
  absl::Status FinishAndDrain() {
    absl::Status sent, end;
    std::thread receiver([this, &end] {
      const std::scoped_lock lock(receiving_);
      end = Drain(std::nullopt);
    });
    {
      const MutexLock lock(sending_);
      if (!std::exchange(finished_, true)) {
        sent = latest_ != nullptr ? latest_->Finish() : stream_->FinishSending();
        if (!sent.ok()) stream_->Cancel();
      }
    }
    receiver.join();
    if (finisher_.joinable()) finisher_.join();
    return sent.ok() ? end : sent;
  }

  // Receives and drops events until the stream has ended or `until` has passed. Returns the error
  // that ended the stream, or OK.
  absl::Status Drain(std::optional<std::chrono::steady_clock::time_point> until) {
    Event event;
    for (;;) {
      const auto got = stream_->Receive(event, kSlice);
      if (!got.ok()) return got.status();
      if (*got == Received::kEnd) return absl::OkStatus();
      if (until && std::chrono::steady_clock::now() >= *until) return absl::OkStatus();
    }
  }

  absl::Status Offer(const client::ParticleArrays& particles, double time)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(sending_) {
    if (finished_) return absl::FailedPreconditionError("frame: sent after finish()");
    ++offered_;  // Before the frame can be answered.
    absl::Status status = latest_->OfferArrays(particles, time);
    if (!status.ok()) --offered_;
    return status;
  }

  // True if no thread is in Receive, and no other thread was the last to receive.
  bool NoOtherReceives() const {
    const std::thread::id last = last_receiver_;
    return receives_ == 0 && (last == std::thread::id() || last == std::this_thread::get_id());
  }

  // Fails if the window is full and no thread but the calling one receives, because SendArrays
  // would then never return. Waits up to kReceiverWait for another thread to begin receiving.
  absl::Status ExpectReceiver() const {
    const auto until = std::chrono::steady_clock::now() + kReceiverWait;
    while (stream_->InFlight() >= Window() && NoOtherReceives()) {
      if (std::chrono::steady_clock::now() >= until) {
        return ViolationError(
            absl::StatusCode::kFailedPrecondition,
            {.reason = "SEND_TIMEOUT",
             .field = "frame",
             .value = "not sent",
             .rule =
                 absl::StrCat("as ", Window(), " frames are in flight, the whole window, and ",
                              "no thread receives: call receive() before send(), or use map()")});
      }
      std::this_thread::sleep_for(kReceiverPoll);
    }
    return absl::OkStatus();
  }

  const std::shared_ptr<ResultPool> results_ = std::make_shared<ResultPool>();
  std::unique_ptr<client::Stream> stream_;
  std::unique_ptr<client::LatestSender> latest_;           // Destroyed before the stream.
  std::thread finisher_;                                   // Runs LatestSender::Finish.
  Doubts warned_;                                          // Guarded by the GIL.
  std::atomic<std::uint64_t> offered_ = 0, answered_ = 0;  // Counts of frames; used with `latest`.
  std::atomic<bool> has_raised_ = false;                   // The loss has been raised.
  std::atomic<int> receives_ = 0;                          // Number of threads in Receive.
  std::atomic<std::thread::id> last_receiver_;             // Default: no thread has received.
  std::timed_mutex receiving_;                             // Held by the receiving thread.
  Mutex sending_;                                          // Held by the sending thread.
  std::uint64_t frames_ ABSL_GUARDED_BY(sending_) = 0;
  bool finished_ ABSL_GUARDED_BY(sending_) = false;
};

py::list Streams(const py::object& given_address, const py::kwargs& given) {
  const auto address = AsOptional<std::string>(given_address, "address");
  Arguments arguments(given);
  const client::Credentials credentials = TakeCredentials(arguments);
  arguments.ExpectNothingElse("streams");
  absl::StatusOr<std::vector<client::StreamSummary>> streams;
  {
    const py::gil_scoped_release others_may_run;
    streams = client::ListStreams(AddressOf(address), std::chrono::seconds(5), credentials);
  }
  RaiseUnlessOk(streams.status());
  using namespace py::literals;
  py::list list;
  for (const client::StreamSummary& one : *streams) {
    list.append(py::dict("name"_a = one.name, "id"_a = one.stream_id, "labels"_a = one.labels,
                         "parameters"_a = ToDict(one.parameters),
                         "last_sequence"_a = one.last_sequence, "frames"_a = one.frames,
                         "frame_errors"_a = one.frame_errors, "watchers"_a = one.watchers,
                         "open_seconds"_a = one.open_seconds, "idle_seconds"_a = one.idle_seconds));
  }
  return list;
}

py::dict Server(const py::object& given_address, const py::kwargs& given) {
  const auto address = AsOptional<std::string>(given_address, "address");
  Arguments arguments(given);
  const client::Credentials credentials = TakeCredentials(arguments);
  arguments.ExpectNothingElse("server");
  absl::StatusOr<client::ServerInfo> info;
  {
    const py::gil_scoped_release others_may_run;
    info = client::GetServerInfo(AddressOf(address), std::chrono::seconds(5), credentials);
  }
  RaiseUnlessOk(info.status());
  using namespace py::literals;
  return py::dict(
      "version"_a = info->version, "method_version"_a = info->method_version,
      "max_particles_per_frame"_a = info->limits.max_particles_per_frame,
      "max_frame_bytes"_a = info->limits.max_frame_bytes, "max_streams"_a = info->max_streams,
      "max_watchers"_a = info->max_watchers, "frames_in_flight"_a = info->frames_in_flight,
      "compute_threads"_a = info->compute_threads, "capabilities"_a = info->capabilities,
      "open_streams"_a = info->open_streams, "draining"_a = info->draining);
}

}  // namespace

void DefineStreams(py::module_& module) {
  using namespace py::literals;
  module.attr("stream_options") =
      NamesTakenBy([](Arguments& none) { TakeStreamOptions(none, false); });
  module.attr("credentials") = NamesTakenBy(&TakeCredentials);
  py::class_<ProducerStream>(
      module, "Stream",
      "A stream to a server, opened by partiemc.connect. One thread may send while another "
      "receives. It survives lost connections; each frame is answered once.")
      .def(py::init<const py::object&, const py::object&, const py::dict&>())
      .def("send", &ProducerStream::Send, "positions"_a, "time"_a = py::none(), py::kw_only(),
           "volumes"_a = py::none(), "ids"_a = py::none(), "velocities"_a = py::none(),
           "attributes"_a = py::none(), "box"_a = py::none(),
           "Sends a frame and returns its number. The arrays (see partiemc.reconstruct) are copied "
           "once, into the message, before it returns. `time` defaults to the number of earlier "
           "frames. `box` is the periodic box of this frame, with the axes of the parameter "
           "`box`.\n\nWaits while `window` frames are sent and not received: a program with "
           "one thread must receive when in_flight has reached window; otherwise partiemc.Error "
           "with reason SEND_TIMEOUT after half a second. With latest=True it never waits and "
           "returns None.")
      .def("receive", &ProducerStream::Receive, "wait"_a = py::none(),
           "The next Result. None if no event arrives within `wait` seconds, and for each accepted "
           "part of a part other than 0. Raises partiemc.Error with a reason for a refused frame "
           "(the stream continues), without a reason if the stream has ended with an error; "
           "EOFError after finish() and the last result.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &ProducerStream::Next)
      .def("finish", &ProducerStream::Finish,
           "Declares that no frame follows: iteration ends with the last result. Never waits. "
           "Frames on the way, and with latest=True the newest frame, still arrive if the program "
           "goes on receiving, leaves `with` or drops the stream, which waits up to 10 s.")
      .def("cancel", &ProducerStream::Cancel, "Ends the stream at once, from any thread.")
      .def("__enter__", [](py::object self) { return self; })
      .def(
          "__exit__",
          [](ProducerStream& stream, const py::object& type, const py::object&, const py::object&) {
            if (type.is_none()) {
              stream.Close();
            } else {
              stream.Cancel();
            }
          })
      .def_property_readonly("in_flight", &ProducerStream::InFlight,
                             "Frames sent and not yet received. With latest=True also the newest "
                             "frame, if it waits to be sent.")
      .def_property_readonly("latest", &ProducerStream::IsLatest,
                             "Whether only the newest frame is kept while the stream is busy.")
      .def_property_readonly("window", &ProducerStream::Window, "Limit of in_flight.")
      .def_property_readonly("id", &ProducerStream::Id,
                             "The current id in the server's log and in partiemc.streams. Each "
                             "reconnection, which `receive` makes, gives the stream a new id.")
      .def_property_readonly("parameters", &ProducerStream::Parameters,
                             "Resolved parameters by name.")
      .def_property_readonly("counts", &ProducerStream::Counts,
                             "With latest=True: frames 'sent', 'skipped', 'refused'.");
  module.def("streams", &Streams, "address"_a = py::none(),
             "Lists the open streams of a server: dicts.");
  module.def("server", &Server, "address"_a = py::none(),
             "Version and limits of a server: a dict.");
}

}  // namespace partiemc::python
