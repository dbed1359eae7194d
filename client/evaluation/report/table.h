// A table, for the terminal and for the page.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace partiemc::evaluation {

struct Cell {
  std::string text;
  bool alert = false;  ///< To be seen: on the page in another colour, as text with a "!".
};

struct TableRow {
  std::string name;
  std::vector<Cell> cells;
  bool part = false;  ///< Belongs to the row above.
};

struct Table {
  std::string title;
  std::string note;  ///< A sentence below the title; may be empty.
  std::vector<std::string> heads;
  std::vector<TableRow> rows;
};

/// Aligned columns, a title line, a blank line at the end.
std::string AsText(const Table& table);

/// A heading, the note and a <table>. Everything is escaped.
std::string AsHtml(const Table& table);

/// So many digits after the point; "-" for what is absent.
std::string Fixed(double value, int digits);

/// Three significant digits: 0.0123, 1.23, 123, 12345; "-" for what is absent.
std::string Significant(double value);

}  // namespace partiemc::evaluation
