// The vectors that this processor has, forced in turn.
#pragma once

#include <hwy/targets.h>

#include <cstdint>

namespace partiemc::support {

/// Calls visit() once with each of the instruction sets that the core is compiled for and this
/// processor has, then leaves the choice as it was. Returns how many there are.
template <typename Visit>
int ForEachInstructionSet(Visit visit) {
  const auto force = [](std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);  // 0: all that the processor has.
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  };
  int count = 0;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    force(target);
    visit();
    ++count;
  }
  force(0);
  return count;
}

}  // namespace partiemc::support
