#include "service/error_table.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

namespace partiemc::server {
namespace {

std::filesystem::path Root() { return PARTIEMC_SOURCE_DIR; }

std::string Read(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// "| `A` | b |" -> {"A", "b"}.
std::vector<std::string> CellsOf(const std::string& line) {
  static const std::regex kMarks("^[ `]+|[ `]+$");
  std::vector<std::string> cells;
  std::istringstream rest(line.substr(1));
  for (std::string cell; std::getline(rest, cell, '|');) {
    cells.push_back(std::regex_replace(cell, kMarks, ""));
  }
  return cells;
}

// "A`, `B" -> {"A", "B"}; "(none)" -> {""}.
std::vector<std::string> ReasonsOf(const std::string& cell) {
  static const std::regex kReason("[A-Z_]+");
  std::vector<std::string> reasons;
  for (std::sregex_iterator at(cell.begin(), cell.end(), kReason), end; at != end; ++at) {
    reasons.push_back(at->str());
  }
  if (reasons.empty()) reasons.push_back("");
  return reasons;
}

using Table = std::vector<std::vector<std::string>>;

// The tables under the heading that begins so, without the names of their columns.
std::vector<Table> TablesUnder(const std::string& heading) {
  std::istringstream page(Read(Root() / "proto" / "PROTOCOL.md"));
  std::vector<Table> tables;
  bool under = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("#")) under = line.starts_with(heading);
    if (!under || !line.starts_with("|") || line.starts_with("|--")) continue;
    if (line.starts_with("| reason |") || line.starts_with("| `WatchEnded.reason` |")) {
      tables.emplace_back();
    } else if (!tables.empty()) {
      tables.back().push_back(CellsOf(line));
    }
  }
  return tables;
}

std::vector<ErrorRow> CallRowsOf(const Table& table) {
  std::vector<ErrorRow> rows;
  for (const auto& cells : table) {
    for (const std::string& reason : ReasonsOf(cells.at(0))) rows.push_back({reason, cells.at(1)});
  }
  return rows;
}

}  // namespace

std::vector<ErrorRow> FrameErrorRows() {
  std::vector<ErrorRow> rows;
  const std::vector<Table> tables = TablesUnder("### A frame is refused");
  for (const auto& cells : tables.at(0)) {
    for (const std::string& reason : ReasonsOf(cells.at(0))) rows.push_back({reason, ""});
  }
  return rows;
}

std::vector<ErrorRow> CallErrorRows() {
  return CallRowsOf(TablesUnder("### A call is refused").at(0));
}

std::vector<ErrorRow> WatchErrorRows() {
  return CallRowsOf(TablesUnder("### A call is refused").at(1));
}

std::vector<std::string> ReasonsInTables() {
  std::vector<std::string> reasons;
  for (const Table& table : TablesUnder("#")) {
    for (const auto& cells : table) {
      for (const std::string& reason : ReasonsOf(cells.at(0))) reasons.push_back(reason);
    }
  }
  return reasons;
}

std::vector<std::string> ReasonsInCode() {
  static const std::regex kConstant("kReason[A-Za-z]+ =\\s*\"([A-Z_]+)\"");
  std::vector<std::string> reasons;
  for (const char* room : {"core", "proto", "server"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(Root() / room)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cc") continue;
      const std::string text = Read(entry.path());
      for (std::sregex_iterator at(text.begin(), text.end(), kConstant), end; at != end; ++at) {
        reasons.push_back((*at)[1]);
      }
    }
  }
  return reasons;
}

}  // namespace partiemc::server
