// Helpers of streams and watches: waiting for events, and addresses.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <optional>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::python {

/// Poll interval for Ctrl-C while waiting for a response.
inline constexpr std::chrono::milliseconds kSlice(100);

/// Calls `receive` repeatedly, each time with a short wait, until it returns something other than
/// kNothingYet or `seconds` have passed (absent: no limit). Waits without the GIL. Between the
/// waits it runs Python's signal handlers, which may raise.
absl::StatusOr<client::Received> Wait(
    std::optional<double> seconds,
    absl::FunctionRef<absl::StatusOr<client::Received>(std::chrono::milliseconds slice)> receive);

/// Implements `__next__` by `receive`: the iteration ends when `receive` raises EOFError.
template <typename Receive>
auto NextBy(Receive receive) {
  try {
    return receive();
  } catch (pybind11::error_already_set& error) {
    if (error.matches(PyExc_EOFError)) throw pybind11::stop_iteration();
    throw;
  }
}

/// `address`, or the address from the environment. Also keeps gRPC initialized from now on.
std::string AddressOf(const std::optional<std::string>& address);

}  // namespace partiemc::python
