// Collects the states that calls reach, and compares them with the table of legal states.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <vector>

#include "server/base/call_state.h"

namespace partiemc::server {

class ReachedStates {
 public:
  void Add(const CallState& state) {
    if (std::ranges::find(states_, state) != states_.end()) return;
    EXPECT_TRUE(IsLegal(state)) << state;
    states_.push_back(state);
  }

  /// Each row of the table that `kind` has is reached, so that no row is there in vain.
  void ExpectAllRowsOf(MachineKind kind) const {
    for (std::size_t k = 0; k < AllLegalStates().size(); ++k) {
      const LegalStates& row = AllLegalStates()[k];
      if (!row.kinds.Has(kind)) continue;
      EXPECT_TRUE(std::ranges::any_of(
          states_, [&](const CallState& state) { return state.kind == kind && row.Has(state); }))
          << "row " << k << " of the table is not reached";
    }
  }

  std::size_t count() const { return states_.size(); }

 private:
  std::vector<CallState> states_;
};

}  // namespace partiemc::server
