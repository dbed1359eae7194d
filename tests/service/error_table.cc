#include "service/error_table.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

#include "partiemc/v1/reconstruction.pb.h"

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

// The tables under the heading with this beginning, without their header rows.
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

// "positions[3].y" -> {"positions[3]", "y"}.
std::vector<std::string> PartsOf(const std::string& path) {
  std::vector<std::string> parts;
  std::istringstream rest(path);
  for (std::string part; std::getline(rest, part, '.');) parts.push_back(part);
  return parts;
}

// Bytes contain numbers, or points of x, y and z.
bool IsPath(const google::protobuf::Descriptor* message, const std::vector<std::string>& parts) {
  static const std::regex kPart("([a-z_]+)(\\[[0-9]+\\])?");
  const google::protobuf::FieldDescriptor* field = nullptr;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::smatch match;
    if (!std::regex_match(parts[k], match, kPart)) return false;
    if (message == nullptr) {
      static const std::regex kCoordinate("[xyz]");
      return k + 1 == parts.size() && std::regex_match(parts[k], kCoordinate) &&
             field->type() == google::protobuf::FieldDescriptor::TYPE_BYTES;
    }
    field = message->FindFieldByName(match[1]);
    if (field == nullptr) return false;
    message = field->message_type();
  }
  return field != nullptr;
}

// Parses the sentence "Beside fields these are spoken of: `client`, `streams`." to {"client",
// "streams"}.
std::vector<std::string> Subjects() {
  static const std::regex kWord("`([^`]+)`");
  const std::string page = Read(Root() / "proto" / "PROTOCOL.md");
  const std::string mark = "Beside fields";
  const std::size_t begin = page.find(mark);
  if (begin == page.npos) return {};
  const std::string sentence = page.substr(begin, page.find(". ", begin) - begin);
  std::vector<std::string> subjects;
  for (std::sregex_iterator at(sentence.begin(), sentence.end(), kWord), end; at != end; ++at) {
    subjects.push_back((*at)[1]);
  }
  return subjects;
}

}  // namespace

bool IsFieldOrSubject(const std::string& field) {
  // A field of one part of a frame.
  static const std::regex kPart("parts\\[[0-9]+\\]\\.(.+)");
  if (std::smatch match; std::regex_match(field, match, kPart)) return IsFieldOrSubject(match[1]);
  const auto subjects = Subjects();
  if (std::find(subjects.begin(), subjects.end(), field) != subjects.end()) return true;
  // Messages that errors refer to, and their parts that a caller fills in.
  for (const google::protobuf::Descriptor* message :
       {v1::ReconstructRequest::descriptor(), v1::OpenStream::descriptor(),
        v1::ParticleFrame::descriptor(), v1::ReconstructFrameRequest::descriptor(),
        v1::WatchStreamRequest::descriptor(), v1::ListStreamsRequest::descriptor(),
        v1::ReconstructedFrame::descriptor(), v1::Rings::descriptor()}) {
    if (IsPath(message, PartsOf(field))) return true;
  }
  return false;
}

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

std::vector<ErrorRow> PartErrorRows() {
  return CallRowsOf(TablesUnder("### A part is refused").at(0));
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
