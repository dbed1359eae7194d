#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "attack/options.h"
#include "attack/processor_share.h"

namespace partiemc::attack {

Options& GetOptions() {
  static Options options;
  return options;
}

}  // namespace partiemc::attack

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  partiemc::attack::Options& options = partiemc::attack::GetOptions();
  CLI::App app("Attacks on a server of its own.");
  app.add_option("--calls", options.calls, "Random calls")->capture_default_str();
  app.add_option("--seconds", options.seconds, "Of hostility")->capture_default_str();
  app.add_option_function<std::uint64_t>(
      "--minutes", [&](std::uint64_t minutes) { options.seconds = 60 * minutes; }, "The same");
  app.add_option("--flood-seconds", options.flood_seconds, "Of a flood without a token")
      ->capture_default_str();
  app.add_option("--attack", options.attack, "This one alone, instead of all at once");
  CLI::Option* const elsewhere =
      app.add_flag("--elsewhere", options.elsewhere,
                   "Attack another server, to see what the attackers' own work costs");
  app.add_flag("--first", options.first,
               "Run the server and the honest clients before all other threads (SCHED_RR), because "
               "real attackers take no processor time of the server's machine. Requires "
               "root, CAP_SYS_NICE or a limit of real-time priorities above 0")
      ->excludes(elsewhere);
  app.add_option("--server", options.server, "Attack this program, such as an earlier build");
  app.add_option("--seed", options.seed, "Of what is random")->capture_default_str();
  app.add_option("--slowdown", options.slowdown, "The most of an honest stream's p99")
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (options.first) {
    // The server and all threads inherit it; attackers give it up (YieldProcessors).
    if (const std::string remedy = partiemc::attack::RunFirst(); !remedy.empty()) {
      std::cerr << "--first: " << remedy << '\n';
      return 2;
    }
  }
  return RUN_ALL_TESTS();
}
