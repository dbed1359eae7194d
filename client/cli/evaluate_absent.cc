// Stands in for evaluate.cc in a build without the evaluation.
#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/evaluate.h"

namespace partiemc::client {

CLI::App* AddEvaluate(CLI::App& app, EvaluateFlags&) {
  CLI::App* verb = app.add_subcommand("evaluate", "(not in this build: -DPARTIEMC_EVALUATION=ON)");
  verb->allow_extras();
  return verb;
}

int Evaluate(const EvaluateFlags&) {
  return Complain(kUsage,
                  "evaluate: this build has no evaluation; configure it by "
                  "`cmake -DPARTIEMC_EVALUATION=ON` and build again");
}

}  // namespace partiemc::client
