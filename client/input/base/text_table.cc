#include "client/input/base/text_table.h"

#include <algorithm>

#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::string_view kBlanks = " \t";

// Most columns of a table. A line of binary data has many more.
constexpr std::size_t kMaxColumns = 4096;

std::string_view Trim(std::string_view cell) {
  cell = Strip(cell);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') {
    cell = Strip(cell.substr(1, cell.size() - 2));
  }
  return cell;
}

bool AllNumbers(const std::vector<std::string_view>& cells) {
  return std::all_of(cells.begin(), cells.end(),
                     [](std::string_view cell) { return ParseNumber(cell).has_value(); });
}

bool IsComment(std::string_view line) { return line.front() == '#' || line.front() == '%'; }

// The end of the cell that starts at `begin`: the next separator outside quotes, or the end of the
// line.
std::size_t CellEnd(std::string_view line, std::size_t begin, char separator) {
  std::size_t open = line.find_first_not_of(kBlanks, begin);
  if (open == std::string_view::npos || line[open] != '"') {
    return std::min(line.find(separator, begin), line.size());
  }
  const std::size_t close = line.find('"', open + 1);
  return std::min(line.find(separator, std::min(close, line.size())), line.size());
}

}  // namespace

void SplitAtBlanks(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  std::size_t begin = line.find_first_not_of(kBlanks);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    cells.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
}

absl::StatusOr<TextTable> TextTable::Open(InputStream& stream) {
  TextTable table(stream);
  std::string_view line;
  const auto found = table.ReadContentLine(line);
  if (!found.ok()) return found.status();
  if (!*found) {
    return absl::DataLossError(
        Concat(stream.path(), ": is empty; a frame without particles is a header without rows"));
  }
  table.RecogniseDialect(line);
  std::vector<std::string_view> cells;
  table.Split(line, cells);
  table.column_count_ = cells.size();
  if (cells.empty() || cells.size() > kMaxColumns) {
    return stream.ErrorAtLine(absl::StatusCode::kDataLoss, "is no table of numbers");
  }
  if (AllNumbers(cells)) {
    table.first_row_ = std::string(line);
    table.first_row_waits_ = true;
  }
  table.TakeHeader(cells);
  return table;
}

void TextTable::TakeHeader(const std::vector<std::string_view>& first) {
  if (!first_row_waits_) {
    names_.assign(first.begin(), first.end());
    return;
  }
  std::vector<std::string_view> words;
  Split(comment_, words);
  if (words.size() != column_count_) SplitAtBlanks(comment_, words);
  if (words.size() == column_count_ && !AllNumbers(words))
    names_.assign(words.begin(), words.end());
}

absl::StatusOr<bool> TextTable::ReadContentLine(std::string_view& line) {
  while (true) {
    const auto found = stream_->ReadLine(line);
    if (!found.ok() || !*found) return found;
    const std::string_view content = Strip(line);
    if (content.empty()) continue;
    if (!IsComment(content)) return true;
    if (column_count_ == 0) comment_ = Strip(content.substr(1));
  }
}

void TextTable::RecogniseDialect(std::string_view line) {
  separator_ = ' ';
  std::vector<std::string_view> cells;
  SplitAtBlanks(line, cells);
  if (AllNumbers(cells)) return;
  for (const char separator : {';', '\t', ','}) {
    if (CellEnd(line, 0, separator) == line.size()) continue;
    separator_ = separator;
    return;
  }
}

void TextTable::Split(std::string_view line, std::vector<std::string_view>& cells) const {
  cells.clear();
  if (separator_ == ' ') {
    line = Strip(line);
    for (std::size_t begin = 0; begin < line.size();) {
      const std::size_t end = CellEnd(line, begin, '\t');
      const std::size_t blank = CellEnd(line, begin, ' ');
      cells.push_back(Trim(line.substr(begin, std::min(end, blank) - begin)));
      begin = std::min(line.find_first_not_of(kBlanks, std::min(end, blank)), line.size());
    }
    return;
  }
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = CellEnd(line, begin, separator_);
    cells.push_back(Trim(line.substr(begin, end - begin)));
    if (end == line.size()) break;
    begin = end + 1;
  }
  if (cells.size() > 1 && cells.back().empty()) cells.pop_back();
}

absl::StatusOr<bool> TextTable::ReadRow(std::vector<std::string_view>& cells) {
  if (first_row_waits_) {
    first_row_waits_ = false;
    Split(first_row_, cells);
    return true;
  }
  std::string_view line;
  const auto found = ReadContentLine(line);
  if (!found.ok() || !*found) return found;
  Split(line, cells);
  return true;
}

}  // namespace partiemc::client::input
