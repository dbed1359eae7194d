// Ends the benchmark if something that it measures has failed.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace partiemc::bench {

/// Prints the reason and exits with code 1.
[[noreturn]] inline void Fail(const std::string& reason) {
  std::fprintf(stderr, "partiemc-bench: %s\n", reason.c_str());
  std::exit(1);
}

inline void Require(const absl::Status& status) {
  if (!status.ok()) Fail(std::string(status.message()));
}

template <typename T>
T Require(absl::StatusOr<T> value) {
  Require(value.status());
  return *std::move(value);
}

}  // namespace partiemc::bench
