#include "client/input/times.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string_view>

#include "absl/strings/ascii.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/base/text_table.h"

namespace partiemc::client::input {
namespace {

struct TimeColumns {
  std::optional<std::size_t> frame;  // Absent: one line per frame.
  std::size_t time = 0;
};

std::optional<std::size_t> Find(const std::vector<std::string>& names, std::string_view wanted) {
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (absl::AsciiStrToLower(names[k]) == wanted) return k;
  }
  return std::nullopt;
}

std::optional<TimeColumns> FindColumns(const TextTable& table) {
  const std::vector<std::string>& names = table.names();
  if (names.empty()) {
    return table.column_count() == 1 ? std::optional(TimeColumns()) : std::nullopt;
  }
  auto time = Find(names, "t");
  if (!time) time = Find(names, "time");
  const auto frame = Find(names, "frame");
  if (!time || (!frame && names.size() > 1)) return std::nullopt;
  return TimeColumns{frame, *time};
}

absl::Status BadRow(const InputStream& stream) {
  return stream.ErrorAtLine(absl::StatusCode::kDataLoss,
                            "a row of frame times must have a frame index and a finite time");
}

}  // namespace

absl::StatusOr<FrameTimes> ReadTimes(const std::string& path) {
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return stream.status();
  auto table = TextTable::Open(**stream);
  if (!table.ok()) return table.status();
  const auto columns = FindColumns(*table);
  if (!columns) {
    return absl::FailedPreconditionError(Concat(
        path, ": is no file of frame times; it must have the columns frame,t or a single one"));
  }
  FrameTimes times;
  std::vector<std::string_view> cells;
  for (std::size_t row = 0;; ++row) {
    const auto found = table->ReadRow(cells);
    if (!found.ok()) return found.status();
    if (!*found) return times;
    if (cells.size() != table->column_count()) return BadRow(**stream);
    const auto frame = columns->frame ? ParseId(cells[*columns->frame]) : row;
    const auto time = ParseNumber(cells[columns->time]);
    if (!frame || !time || !std::isfinite(*time)) return BadRow(**stream);
    if (!times.emplace(*frame, *time).second) {
      return (*stream)->ErrorAtLine(absl::StatusCode::kDataLoss,
                                    Concat("frame ", *frame, " already has a time"));
    }
  }
}

bool IsTimesFile(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  if (absl::AsciiStrToLower(name) != "times.csv") return false;
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return false;
  const auto table = TextTable::Open(**stream);
  if (!table.ok()) return false;
  const auto columns = FindColumns(*table);
  return columns && columns->frame;
}

}  // namespace partiemc::client::input
