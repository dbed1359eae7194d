#include "fuzz/require.h"

#include <cstdio>
#include <cstdlib>
#include <string>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::fuzz {

void Require(bool holds, std::string_view promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", std::string(promise).c_str());
  std::abort();
}

void RequireOk(const absl::Status& status, std::string_view promise) {
  if (!status.ok()) Require(false, absl::StrCat(std::string(promise), ": ", status.ToString()));
}

void RequireViolation(const absl::Status& status) {
  const auto violation = FindViolation(status);
  Require(violation && !violation->reason.empty() && !violation->field.empty() &&
              !violation->value.empty() && !violation->rule.empty(),
          absl::StrCat("a refusal names reason, field, value and rule: ", status.ToString()));
}

void RequireSameCounts(const client::RecordedFrame& frame) {
  const std::size_t count = frame.ParticleCount();
  Require(frame.positions.size() == 2 * count, "two coordinates a particle");
  Require(frame.ids.empty() || frame.ids.size() == count, "ids of all particles, or none");
  Require(frame.volumes.empty() || frame.volumes.size() == count, "volumes of all, or none");
  Require(frame.velocities.empty() || frame.velocities.size() == 2 * count,
          "velocities of all particles, or none");
}

}  // namespace partiemc::fuzz
