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

}  // namespace partiemc::fuzz
