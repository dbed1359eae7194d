// The project's own text files, in memory, so that a test can plant a violation without a copy.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace partiemc::architecture {

/// Path relative to the project's root, with '/' -> content.
using SourceTree = std::map<std::string, std::string>;

/// Every text file below `root`, but for version control, build trees and caches.
/// Requires: `root` is a readable directory.
SourceTree ReadSourceTree(const std::filesystem::path& root);

/// `text` with C++ comments, and the insides of string literals if wanted, replaced by blanks;
/// lines stay where they are.
enum class Literals { kKeep, kBlank };
std::string WithoutComments(std::string_view text, Literals literals);

/// What a file includes: the text between the quotes or brackets, in order.
std::vector<std::string> Includes(std::string_view text);

/// The file of the tree that `include` means in `includer`, empty if it is none of ours: the
/// includer's directory comes first, then its room (first directory), then all others.
std::string ResolveInclude(const SourceTree& tree, const std::string& includer,
                           const std::string& include);

/// What `file` includes, directly or through files of the tree: our own files by their paths,
/// foreign headers by the name in the #include.
struct Reached {
  std::set<std::string> ours;
  std::set<std::string> foreign;
};
Reached Reach(const SourceTree& tree, const std::string& file);

bool IsCxx(std::string_view path);
/// "core" for "core/src/bins/bins.cc".
std::string_view Room(std::string_view path);

}  // namespace partiemc::architecture
