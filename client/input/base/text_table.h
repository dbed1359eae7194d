// Reads text tables: dialect, header, rows.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

/// Splits `line` at runs of blanks. `cells` are views into `line`.
void SplitAtBlanks(std::string_view line, std::vector<std::string_view>& cells);

/// Returns the number of lines of `stream` before the header of its table. Some programs write
/// titles and settings there. The header is the first line with names of positions, or with all
/// names of `columns`, that has the same number of cells as the following line. Returns 0 if the
/// first 64 KiB have no such line, or if the table begins at once. Consumes nothing.
absl::StatusOr<std::size_t> CountPreambleLines(InputStream& stream,
                                               const std::vector<std::string>& columns);

/// A text table with comma, semicolon, tab or blanks between cells; cells may be quoted. Skips
/// empty lines and lines that begin with # or %. The first other line is a header unless all of its
/// cells are numbers. Without such a header, the last comment before the first row is the header,
/// if it has one word per column and is not a row of numbers (NumPy's savetxt).
class TextTable {
 public:
  /// Reads up to the first row. `stream` must outlive the table. kDataLoss if there is no line.
  static absl::StatusOr<TextTable> Open(InputStream& stream);

  /// Names of the columns; empty if there are none.
  const std::vector<std::string>& names() const { return names_; }
  std::size_t column_count() const { return column_count_; }

  /// Reads the next row, valid until the next call. Returns false at the end. Ignores a separator
  /// after the last cell. A row may have more or fewer cells than there are columns.
  absl::StatusOr<bool> ReadRow(std::vector<std::string_view>& cells);

 private:
  explicit TextTable(InputStream& stream) : stream_(&stream) {}

  absl::StatusOr<bool> ReadContentLine(std::string_view& line);
  void TakeHeader(const std::vector<std::string_view>& first);

  InputStream* stream_;
  char separator_ = ' ';
  std::vector<std::string> names_;
  std::size_t column_count_ = 0;
  std::string comment_;    // Last comment before the first row.
  std::string first_row_;  // Read ahead in a table without a header.
  bool first_row_waits_ = false;
};

}  // namespace partiemc::client::input
