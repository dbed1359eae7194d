// The project's text files in memory, so that a test can plant a violation without copying files.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace partiemc::architecture {

/// Path relative to the project's root, with '/', to content.
using SourceTree = std::map<std::string, std::string>;

/// All text files below `root`, except version control, build trees and caches. Requires: `root` is
/// a readable directory.
SourceTree ReadSourceTree(const std::filesystem::path& root);

/// `text` with C++ comments, and optionally the contents of string literals, replaced by blanks;
/// lines keep their positions.
enum class Literals { kKeep, kBlank };
std::string WithoutComments(std::string_view text, Literals literals);

/// The includes of a file in order: the text between quotes or brackets.
std::vector<std::string> Includes(std::string_view text);

/// The includes of all C++ files of a tree. Requires: the tree outlives the graph and does not
/// change.
class IncludeGraph {
 public:
  explicit IncludeGraph(const SourceTree& tree);

  struct Include {
    std::string text;  // Between quotes or brackets.
    std::string file;  // The file that it means; empty for foreign headers.
  };
  /// The includes of a C++ file in order. Each is searched in the includer's directory, its room
  /// (first directory), then all others.
  const std::vector<Include>& Of(const std::string& file) const { return includes_.at(file); }

  /// Files that `file` includes, directly or through files of the tree: ours by path, foreign
  /// headers by their names.
  struct Reached {
    std::set<std::string> ours;
    std::set<std::string> foreign;
  };
  Reached Reach(const std::string& file) const;

 private:
  std::map<std::string, std::vector<Include>> includes_;
};

bool IsCxx(std::string_view path);
/// "core" for "core/src/bins/bins.cc".
std::string_view Room(std::string_view path);

}  // namespace partiemc::architecture
