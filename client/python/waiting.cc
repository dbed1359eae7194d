#include "client/python/waiting.h"

#include <grpc/grpc.h>

#include <algorithm>

#include "client/library/adapters/seconds.h"
#include "partiemc/client/credentials.h"

namespace partiemc::python {
namespace {

namespace py = pybind11;
using client::Received;
using std::chrono::milliseconds;

std::optional<std::chrono::steady_clock::time_point> Until(std::optional<double> seconds) {
  if (!seconds) return std::nullopt;
  return std::chrono::steady_clock::now() + client::ToMilliseconds(*seconds);
}

// Keeps gRPC initialized until the process ends. Otherwise gRPC shuts down with the last stream.
// This shutdown can wait 10 s for gRPC's own objects.
void KeepGrpc() { [[maybe_unused]] static const bool is_kept = (grpc_init(), true); }

}  // namespace

absl::StatusOr<Received> Wait(
    std::optional<double> seconds,
    absl::FunctionRef<absl::StatusOr<Received>(milliseconds slice)> receive) {
  const auto until = Until(seconds);
  for (;;) {
    auto slice = kSlice;
    if (until) {
      slice = std::min(slice,
                       std::chrono::ceil<milliseconds>(*until - std::chrono::steady_clock::now()));
    }
    absl::StatusOr<Received> received = Received::kNothingYet;
    {
      const py::gil_scoped_release others_may_run;
      received = receive(std::max(slice, milliseconds(0)));
    }
    if (!received.ok() || *received != Received::kNothingYet) return received;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (until && std::chrono::steady_clock::now() >= *until) return received;
  }
}

std::string AddressOf(const std::optional<std::string>& address) {
  KeepGrpc();
  return address ? *address : client::ServerFromEnvironment();
}

}  // namespace partiemc::python
