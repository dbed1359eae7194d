// `partiemc convert`: writes any input as a recording (.pemc).
#pragma once

#include <string>

#include "client/input/sequence.h"

namespace CLI {
class App;
}

namespace partiemc::client {

struct ConvertFlags {
  std::string input;
  std::string output;
  SequenceOptions sequence;
  std::string spacing;  ///< World units; empty: the spacing of the input, if it has one.
  std::string title;    ///< Empty: the name of the input.
  bool float64 = false;
  int compression_level = 3;
  bool quiet = false;
};

CLI::App* AddConvert(CLI::App& app, ConvertFlags& flags);

/// Returns the exit code.
int Convert(const ConvertFlags& flags);

}  // namespace partiemc::client
