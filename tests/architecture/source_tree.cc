#include "architecture/source_tree.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace partiemc::architecture {
namespace {

constexpr std::array<std::string_view, 5> kForeignDirectories = {".git", "build", ".cache",
                                                                 "node_modules", "__pycache__"};

std::string_view DirectoryOf(std::string_view path) {
  const auto slash = path.rfind('/');
  return slash == std::string_view::npos ? std::string_view() : path.substr(0, slash + 1);
}

std::string_view NameOf(std::string_view path) { return path.substr(path.rfind('/') + 1); }

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
  static const std::regex kInclude(R"re([ \t]*#[ \t]*include[ \t]*["<]([^">\n]+)[">].*)re");
  std::vector<std::string> includes;
  std::istringstream code(WithoutComments(text, Literals::kKeep));
  std::smatch match;
  for (std::string line; std::getline(code, line);) {
    const bool is_directive = line.find('#') != std::string::npos;
    if (is_directive && std::regex_match(line, match, kInclude)) includes.push_back(match[1]);
  }
  return includes;
}

IncludeGraph::IncludeGraph(const SourceTree& tree) {
  std::map<std::string_view, std::vector<std::string_view>> paths_by_name;
  for (const auto& [path, text] : tree) {
    if (IsCxx(path)) paths_by_name[NameOf(path)].push_back(path);
  }
  const auto file_of = [&](const std::string& includer, const std::string& include) {
    const std::string beside = std::string(DirectoryOf(includer)) + include;
    if (tree.contains(beside)) return beside;
    const std::string ending = "/" + include;
    std::string elsewhere;
    const auto paths = paths_by_name.find(NameOf(include));
    if (paths == paths_by_name.end()) return elsewhere;
    for (const std::string_view path : paths->second) {
      if (path != include && !path.ends_with(ending)) continue;
      if (Room(path) == Room(includer)) return std::string(path);
      if (elsewhere.empty()) elsewhere = path;
    }
    return elsewhere;
  };
  for (const auto& [path, text] : tree) {
    if (!IsCxx(path)) continue;
    std::vector<Include>& includes = includes_[path];
    for (const std::string& include : Includes(text)) {
      includes.push_back({include, file_of(path, include)});
    }
  }
}

IncludeGraph::Reached IncludeGraph::Reach(const std::string& file) const {
  Reached reached;
  std::vector<std::string> open = {file};
  while (!open.empty()) {
    const std::string includer = open.back();
    open.pop_back();
    const auto found = includes_.find(includer);
    if (found == includes_.end()) continue;
    for (const Include& include : found->second) {
      if (include.file.empty()) {
        reached.foreign.insert(include.text);
      } else if (reached.ours.insert(include.file).second) {
        open.push_back(include.file);
      }
    }
  }
  return reached;
}

}  // namespace partiemc::architecture
