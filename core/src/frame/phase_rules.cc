#include "frame/phase_rules.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "frame/frame_view.h"

namespace partiemc {

absl::Status CheckPhaseNumber(const std::string& field, std::int32_t phase) {
  constexpr std::int64_t kMostPhase = 1 << 24;
  if (std::abs(std::int64_t{phase}) <= kMostPhase) return absl::OkStatus();
  return InvalidParameter(field, absl::StrCat(phase),
                          "must be at most 2^24 in magnitude, because attributes are floats");
}

absl::Status CheckPhaseAttribute(const std::string& name, const std::string& reason) {
  const bool is_name =
      !name.empty() && std::ranges::all_of(name, [](char c) { return c >= ' ' && c <= '~'; });
  if (is_name) return absl::OkStatus();
  return InvalidParameter(
      "phase_attribute", name.empty() ? "empty" : "not printable",
      absl::StrCat("must be the name of an attribute, of printable ASCII: ", reason));
}

}  // namespace partiemc
