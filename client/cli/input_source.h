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
  std::optional<double> spacing = {};  ///< Stored in the recording, world units.
};

/// Errors: as Sequence::Open and RecordingReader::Open; INVALID_ARGUMENT for a recording with
/// `select`, `columns`, `times` or `time_step`.
absl::StatusOr<InputSource> OpenInput(const std::string& input, const SequenceOptions& options);

/// Estimates the spacing, to four digits, from the first frame with two different particles.
/// Errors: as OpenInput and Sequence::Next; INVALID_ARGUMENT if there is no such frame.
absl::StatusOr<double> EstimatedSpacing(const std::string& input, const SequenceOptions& options);

/// Checks that no file of `targets` is one of the input: `input` itself or a file of `frames`.
/// Errors: INVALID_ARGUMENT.
absl::Status CheckKeepsInput(const std::string& input, const Sequence& frames,
                             const std::vector<std::string>& targets);

/// Prints the notices of an input on standard error; with `quiet` only its losses.
void PrintNotices(const Sequence& frames, bool quiet);

/// Adds --attributes, a list of names.
CLI::Option* AddAttributesFlag(CLI::App& app, SequenceOptions& options, const std::string& what);

/// Adds --times and --time-step.
std::vector<CLI::Option*> AddTimeFlags(CLI::App& app, SequenceOptions& options);

/// Adds --max-expansion, the limit on the expansion of compressed input.
CLI::Option* AddExpansionFlag(CLI::App& app, SequenceOptions& options);

/// The last part of a path: "dam_break.pemc" of "client/recordings/dam_break.pemc".
std::string BaseName(const std::string& path);

}  // namespace partiemc::client
