#include "architecture/source_tree.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <regex>

namespace partiemc::architecture {
namespace {

constexpr std::array<std::string_view, 5> kForeignDirectories = {".git", "build", ".cache",
                                                                 "node_modules", "__pycache__"};

std::string_view DirectoryOf(std::string_view path) {
  const auto slash = path.rfind('/');
  return slash == std::string_view::npos ? std::string_view() : path.substr(0, slash + 1);
}

}  // namespace

bool IsCxx(std::string_view path) { return path.ends_with(".h") || path.ends_with(".cc"); }

std::string_view Room(std::string_view path) { return path.substr(0, path.find('/')); }

SourceTree ReadSourceTree(const std::filesystem::path& root) {
  SourceTree tree;
  auto entry = std::filesystem::recursive_directory_iterator(root);
  for (; entry != std::filesystem::recursive_directory_iterator(); ++entry) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory()) {
      if (std::ranges::find(kForeignDirectories, name) != kForeignDirectories.end()) {
        entry.disable_recursion_pending();
      }
      continue;
    }
    if (!entry->is_regular_file()) continue;
    std::ifstream file(entry->path(), std::ios::binary);
    std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (text.find('\0') != std::string::npos) continue;  // Recordings, images, archives.
    tree[entry->path().lexically_relative(root).generic_string()] = std::move(text);
  }
  return tree;
}

std::string WithoutComments(std::string_view text, Literals literals) {
  enum { kCode, kLineComment, kBlockComment, kLiteral } mode = kCode;
  char quote = 0;
  std::string code(text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const char next = i + 1 < text.size() ? text[i + 1] : '\0';
    if (mode == kCode) {
      // A quote between digits separates them, as in 16'000'000.
      const bool separator = c == '\'' && i > 0 && std::isalnum(text[i - 1]) != 0;
      if (c == '/' && next == '/') mode = kLineComment;
      if (c == '/' && next == '*') mode = kBlockComment;
      if (c == '"' || (c == '\'' && !separator)) {
        mode = kLiteral;
        quote = c;
        continue;
      }
    }
    if (mode == kCode) continue;
    if (mode == kLiteral) {
      if (c == quote || c == '\n') {
        mode = kCode;
        continue;
      }
      if (literals == Literals::kBlank) code[i] = ' ';
      if (c == '\\' && next != '\n' && i + 1 < text.size()) {
        ++i;
        if (literals == Literals::kBlank) code[i] = ' ';
      }
      continue;
    }
    const bool ends = mode == kLineComment ? c == '\n' : c == '/' && text[i - 1] == '*';
    if (c != '\n') code[i] = ' ';
    if (ends) mode = kCode;
  }
  return code;
}

std::vector<std::string> Includes(std::string_view text) {
  static const std::regex kInclude(R"re((?:^|\n)[ \t]*#[ \t]*include[ \t]*["<]([^">\n]+)[">])re");
  const std::string code = WithoutComments(text, Literals::kKeep);
  std::vector<std::string> includes;
  for (std::sregex_iterator match(code.begin(), code.end(), kInclude), end; match != end; ++match) {
    includes.push_back((*match)[1]);
  }
  return includes;
}

std::string ResolveInclude(const SourceTree& tree, const std::string& includer,
                           const std::string& include) {
  const std::string beside = std::string(DirectoryOf(includer)) + include;
  if (tree.contains(beside)) return beside;
  std::string elsewhere;
  for (const auto& [path, text] : tree) {
    if (path != include && !path.ends_with("/" + include)) continue;
    if (Room(path) == Room(includer)) return path;
    if (elsewhere.empty()) elsewhere = path;
  }
  return elsewhere;
}

Reached Reach(const SourceTree& tree, const std::string& file) {
  Reached reached;
  std::vector<std::string> open = {file};
  while (!open.empty()) {
    const std::string includer = open.back();
    open.pop_back();
    for (const std::string& include : Includes(tree.at(includer))) {
      const std::string path = ResolveInclude(tree, includer, include);
      if (path.empty()) {
        reached.foreign.insert(include);
      } else if (reached.ours.insert(path).second) {
        open.push_back(path);
      }
    }
  }
  return reached;
}

}  // namespace partiemc::architecture
