#include "client/input/base/text_table.h"

#include <algorithm>

#include "client/input/base/columns.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::string_view kBlanks = " \t";

// Maximum number of columns of a table. It rejects binary data, whose lines would have many more.
constexpr std::size_t kMaxColumns = 4096;

constexpr std::size_t kPreambleBytes = std::size_t{64} << 10;

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

char Separator(std::string_view line) {
  std::vector<std::string_view> cells;
  SplitAtBlanks(line, cells);
  if (AllNumbers(cells)) return ' ';
  for (const char separator : {';', '\t', ','}) {
    if (CellEnd(line, 0, separator) != line.size()) return separator;
  }
  return ' ';
}

// Splits a line into trimmed cells. A separator other than blanks at the end of the line adds an
// empty cell.
void SplitAllCells(std::string_view line, char separator, std::vector<std::string_view>& cells) {
  cells.clear();
  if (separator == ' ') {
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
    const std::size_t end = CellEnd(line, begin, separator);
    cells.push_back(Trim(line.substr(begin, end - begin)));
    if (end == line.size()) break;
    begin = end + 1;
  }
}

// Splits the first line of a table. Drops an empty cell behind a separator at the end of the line.
void SplitCells(std::string_view line, char separator, std::vector<std::string_view>& cells) {
  SplitAllCells(line, separator, cells);
  if (cells.size() > 1 && cells.back().empty()) cells.pop_back();
}

// Splits a row of a table. Drops an empty cell behind a separator at the end of the row, but only
// if the row has one cell more than the table has columns.
void SplitRow(std::string_view line, char separator, std::size_t column_count,
              std::vector<std::string_view>& cells) {
  SplitAllCells(line, separator, cells);
  if (cells.size() == column_count + 1 && cells.back().empty()) cells.pop_back();
}

// Whether two lines have the same number of cells, as a header and a row have.
bool SameCellCount(std::string_view header, std::string_view row, char separator) {
  std::vector<std::string_view> cells;
  SplitCells(header, separator, cells);
  const std::size_t column_count = cells.size();
  SplitRow(row, separator, column_count, cells);
  return cells.size() == column_count;
}

struct NumberedLine {
  std::size_t index;
  std::string_view text;
};

// Returns the lines of `head` that are neither blank nor comments. Leaves out the last line, which
// may be cut off.
std::vector<NumberedLine> ContentLines(std::string_view head) {
  std::vector<NumberedLine> lines;
  for (std::size_t index = 0; !head.empty(); ++index) {
    const std::size_t end = head.find('\n');
    if (end == std::string_view::npos) break;
    const std::string_view line = Strip(head.substr(0, end));
    if (!line.empty() && !IsComment(line)) lines.push_back({index, line});
    head.remove_prefix(end + 1);
  }
  return lines;
}

bool IsHeader(std::string_view line, char separator, const std::vector<std::string>& columns) {
  std::vector<std::string_view> cells;
  SplitCells(line, separator, cells);
  if (cells.size() < 2 || cells.size() > kMaxColumns) return false;
  const std::vector<std::string> names(cells.begin(), cells.end());
  if (NamesHoldPositions(names)) return true;
  return !columns.empty() && std::all_of(columns.begin(), columns.end(), [&](const auto& column) {
    return std::find(names.begin(), names.end(), column) != names.end();
  });
}

}  // namespace

absl::StatusOr<std::size_t> CountPreambleLines(InputStream& stream,
                                               const std::vector<std::string>& columns) {
  const auto head = stream.Peek(kPreambleBytes);
  if (!head.ok()) return head.status();
  const std::vector<NumberedLine> lines = ContentLines(*head);
  for (std::size_t k = 0; k + 1 < lines.size(); ++k) {
    const char separator = Separator(lines[k].text);
    if (!IsHeader(lines[k].text, separator, columns)) continue;
    if (k > 0 && !SameCellCount(lines[k].text, lines[k + 1].text, separator)) continue;
    return k == 0 ? 0 : lines[k].index;
  }
  return std::size_t{0};
}

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
  table.separator_ = Separator(line);
  std::vector<std::string_view> cells;
  SplitCells(line, table.separator_, cells);
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
  SplitCells(comment_, separator_, words);
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

absl::StatusOr<bool> TextTable::ReadRow(std::vector<std::string_view>& cells) {
  if (first_row_waits_) {
    first_row_waits_ = false;
    SplitRow(first_row_, separator_, column_count_, cells);
    return true;
  }
  std::string_view line;
  const auto found = ReadContentLine(line);
  if (!found.ok() || !*found) return found;
  SplitRow(line, separator_, column_count_, cells);
  return true;
}

}  // namespace partiemc::client::input
