// One program for all targets: partiemc_fuzz --target=NAME and libFuzzer's own arguments.
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "fuzz/targets.h"

namespace {
const partiemc::fuzz::Target* chosen = nullptr;
}

// Called by libFuzzer, which ignores arguments with two dashes.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  google::protobuf::SetLogHandler(nullptr);
  constexpr std::string_view kFlag = "--target=";
  for (int k = 1; k < *argc; ++k) {
    const std::string_view argument = (*argv)[k];
    if (!argument.starts_with(kFlag)) continue;
    const auto targets = partiemc::fuzz::AllTargets();
    const auto found = std::find_if(targets.begin(), targets.end(), [&](const auto& target) {
      return target.name == argument.substr(kFlag.size());
    });
    if (found != targets.end()) chosen = &*found;
  }
  if (chosen != nullptr) return 0;
  std::fprintf(stderr, "usage: partiemc_fuzz --target=NAME [libFuzzer's arguments]; names:\n");
  for (const auto& target : partiemc::fuzz::AllTargets()) {
    std::printf("%.*s\n", static_cast<int>(target.name.size()), target.name.data());
  }
  std::exit(2);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->attack({data, size});
  return 0;
}
