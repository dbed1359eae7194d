#include "client/input/file_list.h"

#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_join.h"
#include "client/input/base/natural_order.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

namespace fs = std::filesystem;

// The texts and numbers of a file name: "run1_007.csv" has the texts "run", "_", ".csv" and the
// numbers "1", "007". There is one text more than numbers.
struct NameParts {
  std::vector<std::string> texts = {""};
  std::vector<std::string> numbers;
};

NameParts TakeApart(const std::string& name) {
  NameParts parts;
  bool in_number = false;
  for (const char c : name) {
    const bool digit = absl::ascii_isdigit(static_cast<unsigned char>(c));
    if (digit && !in_number) parts.numbers.emplace_back();
    if (!digit && in_number) parts.texts.emplace_back();
    (digit ? parts.numbers : parts.texts).back().push_back(c);
    in_number = digit;
  }
  if (in_number) parts.texts.emplace_back();
  return parts;
}

// The name with "*" for each number that `replace` selects.
std::string PatternOf(const NameParts& parts, const std::vector<bool>& replace) {
  std::string pattern = parts.texts.front();
  for (std::size_t k = 0; k < parts.numbers.size(); ++k) {
    AppendAll(pattern, replace[k] ? "*" : parts.numbers[k], parts.texts[k + 1]);
  }
  return pattern;
}

// Selects the numbers that differ between the names. Requires: all names have the same texts.
std::vector<bool> VaryingNumbers(const std::vector<NameParts>& names) {
  std::vector<bool> varying(names.front().numbers.size(), false);
  for (const NameParts& name : names) {
    for (std::size_t k = 0; k < varying.size(); ++k) {
      varying[k] = varying[k] || name.numbers[k] != names.front().numbers[k];
    }
  }
  return varying;
}

// Groups files into series. With `one_number` the names of a series differ only in the last number
// that varies; otherwise they may differ in all numbers.
std::vector<FileSeries> GroupBySeries(std::vector<std::string> files, bool one_number) {
  std::sort(files.begin(), files.end(), NaturalLess);
  std::map<std::vector<std::string>, std::vector<std::string>> by_texts;
  for (std::string& file : files) {
    by_texts[TakeApart(fs::path(file).filename().string()).texts].push_back(std::move(file));
  }
  std::map<std::string, FileSeries> by_pattern;
  for (auto& [texts, members] : by_texts) {
    std::vector<NameParts> names;
    for (const std::string& file : members) {
      names.push_back(TakeApart(fs::path(file).filename().string()));
    }
    std::vector<bool> replace = VaryingNumbers(names);
    if (one_number) {
      const auto last = std::find(replace.rbegin(), replace.rend(), true);
      for (auto it = last; it != replace.rend(); ++it) *it = it == last;
    }
    for (std::size_t k = 0; k < members.size(); ++k) {
      FileSeries& series = by_pattern[PatternOf(names[k], replace)];
      std::error_code error;
      const auto bytes = fs::file_size(members[k], error);
      series.bytes += error ? 0 : bytes;
      series.files.push_back(std::move(members[k]));
    }
  }
  std::vector<FileSeries> all;
  for (auto& [pattern, series] : by_pattern) {
    series.uncertain_order = SortNaturally(series.files);
    const bool single = series.files.size() == 1;
    series.pattern = single ? fs::path(series.files.front()).filename().string() : pattern;
    all.push_back(std::move(series));
  }
  std::sort(all.begin(), all.end(), [](const FileSeries& a, const FileSeries& b) {
    return NaturalLess(a.pattern, b.pattern);
  });
  return all;
}

absl::StatusOr<InputFiles> ListDirectory(const std::string& directory) {
  std::error_code error;
  std::vector<std::string> files;
  std::vector<std::string> folders;
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.front() == '.') continue;
    std::error_code kind_error;
    if (it->is_regular_file(kind_error)) files.push_back(it->path().string());
    if (it->is_directory(kind_error)) folders.push_back(name);
  }
  if (error) {
    return absl::PermissionDeniedError(Concat(directory, ": cannot be listed: ", error.message()));
  }
  if (files.empty()) {
    std::sort(folders.begin(), folders.end(), NaturalLess);
    folders.resize(std::min<std::size_t>(folders.size(), 8));
    return absl::NotFoundError(Concat(
        directory, ": holds no files",
        folders.empty() ? ""
                        : Concat("; name one of its folders: ", absl::StrJoin(folders, ", "))));
  }
  return InputFiles{InputKind::kDirectory, directory, GroupBySeries(std::move(files), true)};
}

absl::StatusOr<InputFiles> ListPattern(const std::string& pattern) {
  glob_t found = {};
  const int result = glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found);
  std::vector<std::string> files;
  for (std::size_t k = 0; result == 0 && k < found.gl_pathc; ++k) {
    std::error_code error;
    if (fs::is_regular_file(found.gl_pathv[k], error)) files.emplace_back(found.gl_pathv[k]);
  }
  globfree(&found);
  if (files.empty()) {
    return absl::NotFoundError(Concat(pattern, ": no file has such a name; check the pattern"));
  }
  std::string directory = fs::path(pattern).parent_path().string();
  return InputFiles{InputKind::kPattern, std::move(directory),
                    GroupBySeries(std::move(files), false)};
}

}  // namespace

absl::StatusOr<InputFiles> ListInput(const std::string& input) {
  std::error_code error;
  const fs::file_status status = fs::status(input, error);
  if (fs::is_directory(status)) return ListDirectory(input);
  const bool pattern = input.find_first_of("*?[") != std::string::npos;
  if (!fs::exists(status) && pattern) return ListPattern(input);
  if (!fs::exists(status)) {
    if (const std::size_t at = input.find("{}"); at != std::string::npos) {
      return absl::NotFoundError(Concat(input, ": {} is no pattern; write '",
                                        std::string(input).replace(at, 2, "*"), "'"));
    }
    return absl::NotFoundError(Concat(input, ": no such file or directory; check the path"));
  }
  InputFiles files{InputKind::kFile, fs::path(input).parent_path().string(),
                   GroupBySeries({input}, false)};
  return files;
}

absl::Status SeveralSeries(const std::string& input, const InputFiles& files) {
  constexpr std::size_t kShown = 8;
  std::vector<std::string> shown;
  const FileSeries* largest = &files.series.front();
  for (const FileSeries& series : files.series) {
    if (shown.size() < kShown) {
      shown.push_back(Concat(series.pattern, " (", series.files.size(),
                             series.files.size() == 1 ? " file)" : " files)"));
    }
    if (series.bytes > largest->bytes) largest = &series;
  }
  if (files.series.size() > kShown) shown.push_back("...");
  const std::string proposal = (fs::path(files.directory) / largest->pattern).string();
  return absl::FailedPreconditionError(
      Concat(input, ": holds ", files.series.size(), " series: ", absl::StrJoin(shown, ", "),
             "; choose one with a pattern such as '", proposal, "'"));
}

}  // namespace partiemc::client::input
