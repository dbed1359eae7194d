// `partiemc evaluate`: all methods measured, in this process, and the paper's claims with them.
#pragma once

#include <string>
#include <vector>

#include "client/input/sequence.h"

namespace CLI {
class App;
}

namespace partiemc::client {

struct EvaluateFlags {
  std::string set = "smoke";
  std::vector<std::string> recordings;
  std::string recordings_dir;        ///< All of its recordings, too.
  SequenceOptions sequence;          ///< Of the recordings.
  std::vector<std::string> methods;  ///< Empty: all.
  bool steps = false;
  bool sensitivity = false;
  bool volumes = false;
  bool ids = false;
  std::string output_dir;
  int threads = 0;  ///< 0: one for each processor.
  bool quiet = false;
};

/// Adds the verb to `app`; its flags go to `flags`, which must outlive the parsing.
CLI::App* AddEvaluate(CLI::App& app, EvaluateFlags& flags);

/// Returns the exit code.
int Evaluate(const EvaluateFlags& flags);

}  // namespace partiemc::client
