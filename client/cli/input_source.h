// Opens the input of a verb: a recording, or any other format that Sequence reads.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/sequence.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace partiemc::client {

struct InputSource {
  std::unique_ptr<Sequence> frames;
  std::optional<double> spacing = {};  ///< World units, if the recording holds it.
};

/// Errors: as Sequence::Open.
absl::StatusOr<InputSource> OpenInput(const std::string& input, const SequenceOptions& options);

/// The spacing that the first frame with two different particles shows, to four digits.
/// Errors: as Sequence::Open and Next; INVALID_ARGUMENT if no frame shows one.
absl::StatusOr<double> EstimatedSpacing(const std::string& input, const SequenceOptions& options);

/// Adds --attributes, a list of names.
CLI::Option* AddAttributesFlag(CLI::App& app, SequenceOptions& options, const std::string& what);

/// Adds --times and --time-step.
std::vector<CLI::Option*> AddTimeFlags(CLI::App& app, SequenceOptions& options);

/// Adds --max-expansion, a bound for packed input.
CLI::Option* AddExpansionFlag(CLI::App& app, SequenceOptions& options);

/// The last part of a path: "dam_break.pemc" of "client/recordings/dam_break.pemc".
std::string BaseName(const std::string& path);

}  // namespace partiemc::client
