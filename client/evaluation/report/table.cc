#include "client/evaluation/report/table.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "client/output/html.h"
#include "client/output/text.h"

namespace partiemc::evaluation {

using client::EscapeHtml;
namespace {

using client::AppendAll;

std::string Text(const Cell& cell) { return cell.text + (cell.alert ? "!" : ""); }

std::string Name(const TableRow& row) { return (row.part ? "  " : "") + row.name; }

}  // namespace

std::string AsText(const Table& table) {
  std::size_t name_width = 0;
  std::vector<std::size_t> widths;
  for (const std::string& head : table.heads) widths.push_back(head.size());
  for (const TableRow& row : table.rows) {
    name_width = std::max(name_width, Name(row).size());
    for (std::size_t k = 0; k < row.cells.size(); ++k) {
      widths[k] = std::max(widths[k], Text(row.cells[k]).size());
    }
  }
  std::string out = table.title + "\n";
  if (!table.note.empty()) AppendAll(out, table.note, "\n");
  out += std::string(name_width, ' ');
  for (std::size_t k = 0; k < widths.size(); ++k) {
    absl::StrAppendFormat(&out, "  %*s", widths[k], table.heads[k]);
  }
  out += "\n";
  for (const TableRow& row : table.rows) {
    absl::StrAppendFormat(&out, "%-*s", name_width, Name(row));
    for (std::size_t k = 0; k < row.cells.size(); ++k) {
      absl::StrAppendFormat(&out, "  %*s", widths[k], Text(row.cells[k]));
    }
    out += "\n";
  }
  return out + "\n";
}

std::string AsHtml(const Table& table) {
  std::string out = client::Concat("<h3>", EscapeHtml(table.title), "</h3>\n");
  if (!table.note.empty())
    AppendAll(out, "<p class=\"headline\">", EscapeHtml(table.note), "</p>\n");
  out += "<div class=\"wide\"><table><thead><tr><td></td>";
  for (const std::string& head : table.heads) {
    AppendAll(out, "<th scope=\"col\">", EscapeHtml(head), "</th>");
  }
  out += "</tr></thead><tbody>\n";
  for (const TableRow& row : table.rows) {
    AppendAll(out, row.part ? "<tr class=\"part\">" : "<tr>", "<th scope=\"row\">",
              EscapeHtml(row.name), "</th>");
    for (const Cell& cell : row.cells) {
      AppendAll(out, cell.alert ? "<td class=\"alert\">" : "<td>", EscapeHtml(cell.text), "</td>");
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string Fixed(double value, int digits) {
  return std::isnan(value) ? "-" : absl::StrFormat("%.*f", digits, value);
}

std::string Significant(double value) {
  if (std::isnan(value)) return "-";
  if (value == 0) return "0";
  const int before = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
  return absl::StrFormat("%.*f", std::clamp(3 - before, 0, 6), value);
}

}  // namespace partiemc::evaluation
