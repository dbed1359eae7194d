// A line on standard error that says what is being measured, and what ends a run that cannot.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::bench {

/// Replaces the line before on a terminal, follows it elsewhere.
void Progress(const std::string& text);

/// A benchmark of something that failed means nothing: main says why and leaves with exit code 1,
/// after the servers have been stopped on the way.
struct Failure : std::runtime_error {
  using std::runtime_error::runtime_error;
};
[[noreturn]] inline void Fail(const std::string& why) { throw Failure(why); }

inline void Require(const absl::Status& status) {
  if (!status.ok()) Fail(std::string(status.message()));
}

template <typename T>
T Require(absl::StatusOr<T> value) {
  Require(value.status());
  return *std::move(value);
}

}  // namespace partiemc::bench
