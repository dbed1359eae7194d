// Errors of options that are set outside of the command line: they name the line of the config
// file, or the environment variable.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace partiemc::server {

/// Reads the config file of `app` and remembers the lines of its options. Errors are
/// CLI::ConfigError with a message that begins with "FILE:LINE: ".
class ConfigFile final : public CLI::ConfigTOML {
 public:
  /// `app` must outlive the object.
  explicit ConfigFile(const CLI::App& app) : app_(app) {}

  /// Called by CLI11 after it has parsed the command line.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

  /// Returns `error` after "FILE:LINE: " if it names an option with a value from the file,
  /// otherwise as it is.
  std::string WithLine(const std::string& error) const;

 private:
  std::string Place(std::size_t line) const;

  const CLI::App& app_;
  mutable std::map<std::string, std::size_t> lines_;  // By "--name". CLI11's function is const.
};

/// Environment variables PARTIEMC_* that set no option.
struct UnknownVariables {
  std::optional<std::string> error;  ///< Set if one is probably a misspelt name of an option.
  std::vector<std::string> ignored;  ///< Names of the others.
};

/// Finds them in `environment`, NAME=VALUE with a null pointer at the end. Variables without a
/// value count as unset, as for options. The variables that Kubernetes sets for a Service of the
/// name `partiemc` or `partiemc-*` are not unknown.
UnknownVariables FindUnknownVariables(const CLI::App& app, const char* const* environment);

}  // namespace partiemc::server
