#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "resume/options.h"

namespace partiemc::resume {

Options& GetOptions() {
  static Options options;
  return options;
}

namespace {

// Reads options `--name N`; false for anything else.
bool Parse(int argc, char** argv) {
  Options& options = GetOptions();
  for (int k = 1; k < argc; k += 2) {
    bool known = std::string(argv[k]) == "--other-server" && k + 1 < argc;
    if (known) options.other_server = argv[k + 1];
    for (const auto& [name, value] :
         {std::pair("--kills", &options.kills), std::pair("--terminations", &options.terminations),
          std::pair("--faults", &options.faults), std::pair("--updates", &options.updates),
          std::pair("--seed", &options.seed), std::pair("--time-limits", &options.time_limits)}) {
      if (name != std::string(argv[k]) || k + 1 >= argc) continue;
      *value = std::strtoull(argv[k + 1], nullptr, 10);
      known = true;
    }
    if (!known) return false;
  }
  return true;
}

}  // namespace
}  // namespace partiemc::resume

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (partiemc::resume::Parse(argc, argv)) return RUN_ALL_TESTS();
  std::fputs(
      "usage: resume_test [--kills N] [--terminations N] [--faults N] [--updates N] "
      "[--seed N] [--time-limits N] [--other-server PROGRAM]\n",
      stderr);
  return 2;
}
