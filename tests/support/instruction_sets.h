// Runs tests with each instruction set of this processor.
#pragma once

#include <hwy/targets.h>

#include <cstdint>

namespace partiemc::support {

/// Calls visit() once for each instruction set that the core is compiled for and this processor
/// has, then restores the selection. Returns their number.
template <typename Visit>
int ForEachInstructionSet(Visit visit) {
  const auto force = [](std::int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);  // 0: all of the processor's.
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
