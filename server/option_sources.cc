#include "server/option_sources.h"

#include <algorithm>
#include <istream>
#include <iterator>
#include <numeric>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "common/text.h"

namespace partiemc::server {
namespace {

constexpr std::string_view kPrefix = "PARTIEMC_";
constexpr char kConfigVariable[] = "PARTIEMC_CONFIG";

// A name counts as misspelt if at most one in this many of its characters is wrong.
constexpr std::size_t kCharactersPerError = 4;

// Minimum number of characters to insert, remove or replace to turn one text into the other
// (Levenshtein's distance).
std::size_t Distance(std::string_view one, std::string_view other) {
  std::vector<std::size_t> row(other.size() + 1);  // Distances to the beginnings of `other`.
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < one.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < other.size(); ++j) {
      const std::size_t replaced = diagonal + (one[i] == other[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

// Returns the element of `names` with the least distance to `name`. Requires: `names` not empty.
const std::string& NearestName(std::string_view name, const std::vector<std::string>& names) {
  return *std::ranges::min_element(names, {},
                                   [&](const std::string& other) { return Distance(name, other); });
}

// The options of a config file, without dashes.
std::vector<std::string> ConfigNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_configurable()) names.push_back(option->get_single_name());
  }
  return names;
}

// Whether `name` is probably a misspelt `other`.
bool IsMisspelt(std::string_view name, std::string_view other) {
  return Distance(name, other) * kCharactersPerError <= name.size();
}

// Returns the number of the first line that begins with `name`, quoted or not, if it is a whole
// word there. Returns 0 without such a line.
std::size_t LineOf(std::string_view text, std::string_view name) {
  std::size_t number = 0;
  for (std::string_view line : Split(text, '\n')) {
    ++number;
    if (!line.starts_with(name) && !ConsumePrefix(line, "\"")) ConsumePrefix(line, "'");
    if (!ConsumePrefix(line, name)) continue;
    if (line.empty() || std::string_view("=\"' \t#").find(line.front()) != std::string_view::npos) {
      return number;
    }
  }
  return 0;
}

// Whether `error` contains `flag`, and not as the beginning of a longer flag.
bool Names(std::string_view error, std::string_view flag) {
  for (auto at = error.find(flag); at != std::string_view::npos; at = error.find(flag, at + 1)) {
    const std::string_view rest = error.substr(at + flag.size());
    if (rest.empty()) return true;
    const char next = rest.front();
    if (!absl::ascii_isalnum(static_cast<unsigned char>(next)) && next != '-') return true;
  }
  return false;
}

// Whether Kubernetes sets this variable for a Service ("service links"), such as
// PARTIEMC_SERVICE_HOST, PARTIEMC_SERVICE_PORT_WEB, PARTIEMC_PORT_50051_TCP_ADDR. The value of
// PARTIEMC_PORT is then a URL.
bool IsServiceLink(std::string_view name, std::string_view value) {
  constexpr std::string_view kPort = "_PORT_";
  const std::size_t port = std::min(name.find(kPort), name.size());
  const std::string_view number = name.substr(std::min(port + kPort.size(), name.size()));
  const bool has_number =
      !number.empty() && absl::ascii_isdigit(static_cast<unsigned char>(number.front()));
  return name.ends_with("_SERVICE_HOST") || name.find("_SERVICE_PORT") != std::string_view::npos ||
         has_number || (name.ends_with("_PORT") && value.find("://") != std::string_view::npos);
}

}  // namespace

std::string ConfigFile::Place(std::size_t line) const {
  const auto path = app_.get_config_ptr()->as<std::string>();
  return line == 0 ? absl::StrCat(path, ": ") : absl::StrCat(path, ":", line, ": ");
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  const std::string text(std::istreambuf_iterator<char>(input), {});
  std::istringstream again(text);
  auto options = CLI::ConfigTOML::from_config(again);
  for (const CLI::ConfigItem& item : options) {
    if (!item.parents.empty()) {
      const std::string section = absl::StrCat("[", item.parents.front(), "]");
      const std::size_t line = std::max(LineOf(text, section), LineOf(text, item.fullname()));
      throw CLI::ConfigError(absl::StrCat(Place(line), section, ": the file may have no sections"));
    }
    const std::size_t line = LineOf(text, item.name);
    const CLI::Option* option = app_.get_option_no_throw("--" + item.name);
    if (option == nullptr) option = app_.get_option_no_throw(item.name);
    if (option == nullptr) {
      std::string error = absl::StrCat(Place(line), "there is no option `", item.name, "`");
      const std::vector<std::string> names = ConfigNames(app_);
      const std::string& nearest = NearestName(item.name, names);
      if (IsMisspelt(item.name, nearest)) {
        absl::StrAppend(&error, "; the nearest is `", nearest, "`");
      }
      throw CLI::ConfigError(error);
    }
    if (!option->get_configurable()) {
      throw CLI::ConfigError(
          absl::StrCat(Place(line), "`", item.name, "` may only be on the command line"));
    }
    // An option that the command line sets keeps its value.
    if (option->count() == 0) lines_.emplace(option->get_name(), line);
  }
  return options;
}

std::string ConfigFile::WithLine(const std::string& error) const {
  for (const auto& [flag, line] : lines_) {
    if (Names(error, flag)) return Place(line) + error;
  }
  return error;
}

UnknownVariables FindUnknownVariables(const CLI::App& app, const char* const* environment) {
  std::map<std::string, std::string> options = {{kConfigVariable, "--config"}};
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_envname().empty()) options[option->get_envname()] = option->get_name();
  }
  std::vector<std::string> names;
  for (const auto& [name, flag] : options) names.push_back(name);

  UnknownVariables unknown;
  for (; *environment != nullptr; ++environment) {
    const std::string_view variable = *environment;
    const std::size_t end = std::min(variable.find('='), variable.size());
    const std::string name(variable.substr(0, end));
    const std::string_view value = variable.substr(std::min(end + 1, variable.size()));
    if (!name.starts_with(kPrefix) || value.empty() || options.contains(name)) continue;
    if (IsServiceLink(name, value)) continue;
    const std::string& nearest = NearestName(name, names);
    if (!IsMisspelt(std::string_view(name).substr(kPrefix.size()),
                    std::string_view(nearest).substr(kPrefix.size()))) {
      unknown.ignored.push_back(name);
    } else if (!unknown.error) {
      unknown.error =
          absl::StrCat("the environment variable ", name, " sets no option; the nearest is ",
                       nearest, " (", options[nearest], ")");
    }
  }
  return unknown;
}

}  // namespace partiemc::server
