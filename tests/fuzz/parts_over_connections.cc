// Parts of frames from several connections of several streams, in an order chosen by the fuzzer.
#include <algorithm>
#include <string>

#include "fuzz/choices.h"
#include "fuzz/require.h"
#include "fuzz/single_thread.h"
#include "server/parts_model.h"

namespace partiemc::fuzz {

void AttackPartsOverConnections(Bytes bytes) {
  const SingleThread single_thread;
  static auto* const pool = new server::SteppedPool;
  constexpr std::size_t kMostSteps = 300;
  Choices choices(bytes);
  const server::ChooseBelow choose = [&](std::size_t count) { return choices.Below(count); };
  const std::string broken =
      server::RunPartsModel(*pool, choose, std::min(bytes.size() / 3, kMostSteps));
  Require(broken.empty(), broken);
}

}  // namespace partiemc::fuzz
