// Lines of a text table: dialect, header, cells.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

/// Splits `line` at blanks; consecutive ones count as one. Views into `line`.
void SplitAtBlanks(std::string_view line, std::vector<std::string_view>& cells);

/// A table in text: comma, semicolon, tab or blanks between cells; cells may be in quotes. Empty
/// lines and lines that begin with # or % are passed over. The first other line is a header unless
/// all of its cells are numbers; without one, the last comment before it is taken for the header if
/// it has as many words as there are columns and is no row of numbers (NumPy's savetxt).
class TextTable {
 public:
  /// Reads up to the first row. `stream` must outlive the table. kDataLoss if there is no line.
  static absl::StatusOr<TextTable> Open(InputStream& stream);

  /// Names of the columns; empty if there are none.
  const std::vector<std::string>& names() const { return names_; }
  std::size_t column_count() const { return column_count_; }

  /// The next row, valid until the next call; false at the end. A separator after the last cell is
  /// no cell. A row may have more or fewer cells than there are columns.
  absl::StatusOr<bool> ReadRow(std::vector<std::string_view>& cells);

 private:
  explicit TextTable(InputStream& stream) : stream_(&stream) {}

  absl::StatusOr<bool> ReadContentLine(std::string_view& line);
  void RecogniseDialect(std::string_view line);
  void Split(std::string_view line, std::vector<std::string_view>& cells) const;
  void TakeHeader(const std::vector<std::string_view>& first);

  InputStream* stream_;
  char separator_ = ' ';
  std::vector<std::string> names_;
  std::size_t column_count_ = 0;
  std::string comment_;    // The last one before the first row.
  std::string first_row_;  // Read ahead where there is no header.
  bool first_row_waits_ = false;
};

}  // namespace partiemc::client::input
