// One frame per file: named NPY arrays in a zip archive.
#include <algorithm>
#include <utility>

#include "client/input/base/text.h"
#include "client/input/base/zip_archive.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/npy.h"
#include "client/input/formats/pysph.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxColumns = 65'536;

struct NamedArray {
  ZipEntry entry;
  std::string name;
  NpyHeader header;
  std::size_t first_column = 0;
  std::size_t column_count = 0;
};

struct NpzTable {
  std::vector<NamedArray> arrays;
  std::vector<std::string> column_names;
  absl::Status not_plain;  // Error of the first array without plain numbers; OK if there is none.
  std::optional<NamedArray> time;
};

absl::StatusOr<NpzTable> ReadTable(const ZipArchive& archive, const std::string& path) {
  NpzTable table;
  for (const ZipEntry& entry : archive.entries()) {
    if (!entry.name.ends_with(".npy")) continue;
    const auto source = archive.OpenEntry(entry);
    if (!source.ok()) return source.status();
    NamedArray array{entry, entry.name.substr(0, entry.name.size() - 4), {}, 0, 0};
    auto header = ReadNpyHeader(**source, Concat(path, ": ", array.name));
    if (header.status().code() == absl::StatusCode::kUnimplemented) {
      table.not_plain.Update(header.status());
      continue;
    }
    if (!header.ok()) return header.status();
    array.header = *std::move(header);
    const std::size_t dimensions = array.header.shape.size();
    if ((array.name == "t" || array.name == "time") && array.header.element_count() == 1) {
      table.time = std::move(array);
      continue;
    }
    if (dimensions != 1 && (dimensions != 2 || array.header.shape[1] > kMaxArrayComponents))
      continue;
    array.first_column = table.column_names.size();
    const std::vector<std::string> names = NpyTable(array.header, array.name, {}).names;
    array.column_count = names.size();
    table.column_names.insert(table.column_names.end(), names.begin(), names.end());
    if (table.column_names.size() > kMaxColumns) {
      return absl::DataLossError(Concat(path, ": has more than ", kMaxColumns, " columns"));
    }
    table.arrays.push_back(std::move(array));
  }
  return table;
}

// Expands the name of an array: if --columns has only this name, replaces it by the names of the
// array's components.
ColumnRequest WithArraysExpanded(const ColumnRequest& request, const NpzTable& table) {
  if (request.columns.size() != 1) return request;
  ColumnRequest expanded = request;
  for (const NamedArray& array : table.arrays) {
    if (array.name != request.columns[0] || array.header.shape.size() != 2) continue;
    const auto begin = table.column_names.begin() + static_cast<std::ptrdiff_t>(array.first_column);
    expanded.columns.assign(begin, begin + static_cast<std::ptrdiff_t>(array.column_count));
  }
  return expanded;
}

// Removes optional arrays from the plan if they have another number of rows than the positions.
void DropForeignColumns(const NpzTable& table, ColumnPlan& plan) {
  std::vector<std::size_t> rows;
  for (const NamedArray& array : table.arrays) {
    rows.insert(rows.end(), array.column_count, array.header.shape[0]);
  }
  const auto first = std::find_if(plan.positions.begin(), plan.positions.end(),
                                  [](const auto& column) { return column.has_value(); });
  const std::size_t particles = rows[**first];
  for (auto& column : plan.velocities) {
    if (column && rows[*column] != particles) plan.velocities = {};
  }
  if (plan.id && rows[*plan.id] != particles) plan.id.reset();
  if (plan.volume && rows[*plan.volume] != particles) plan.volume.reset();
}

class NpzReader final : public OneFrameReader {
 public:
  NpzReader(std::string path, ZipArchive archive, NpzTable table, ColumnPlan plan,
            const ColumnRequest& request)
      : path_(std::move(path)),
        archive_(std::move(archive)),
        table_(std::move(table)),
        plan_(std::move(plan)),
        request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    const std::vector<bool> needed = NeededColumns(plan_);
    std::vector<ArrayColumn> columns(table_.column_names.size());
    std::vector<std::vector<char>> bytes(table_.arrays.size());
    const NamedArray* first = nullptr;
    for (std::size_t k = 0; k < table_.arrays.size(); ++k) {
      const NamedArray& array = table_.arrays[k];
      const auto begin = needed.begin() + static_cast<std::ptrdiff_t>(array.first_column);
      if (std::find(begin, begin + static_cast<std::ptrdiff_t>(array.column_count), true) ==
          begin + static_cast<std::ptrdiff_t>(array.column_count)) {
        continue;
      }
      if (first == nullptr) first = &array;
      if (array.header.shape[0] != first->header.shape[0]) {
        return absl::DataLossError(Concat(path_, ": ", array.name, " has ", array.header.shape[0],
                                          " rows, ", first->name, " has ", first->header.shape[0],
                                          "; arrays must have a row per particle"));
      }
      absl::Status status = CheckParticleCount(array.header.shape[0]);
      if (!status.ok()) return WithPrefix(path_, status);
      status = Load(array, bytes[k]);
      if (!status.ok()) return status;
      const std::vector<ArrayColumn> loaded = NpyTable(array.header, array.name, bytes[k]).columns;
      std::copy(loaded.begin(), loaded.end(),
                columns.begin() + static_cast<std::ptrdiff_t>(array.first_column));
    }
    rows.Begin(plan_);
    rows.source = path_;
    const absl::Status status =
        AppendArrayRows(columns, first->header.shape[0], plan_, request_, rows);
    if (!status.ok()) return WithPrefix(path_, status);
    return ReadTime(rows.time);
  }

  absl::Status Load(const NamedArray& array, std::vector<char>& bytes) const {
    const std::string name = Concat(path_, ": ", array.name);
    const auto source = archive_.OpenEntry(array.entry);
    if (!source.ok()) return source.status();
    const auto header = ReadNpyHeader(**source, name);
    if (!header.ok()) return header.status();
    // The plan was made with the earlier header, so this header is used even if the file has
    // changed since.
    return ReadNpyElements(**source, array.header, name, bytes);
  }

  absl::Status ReadTime(std::optional<double>& time) const {
    if (!table_.time) return absl::OkStatus();
    NamedArray array = *table_.time;
    std::vector<char> bytes;
    if (absl::Status status = Load(array, bytes); !status.ok()) return status;
    array.header.shape = {1};
    time = NpyTable(array.header, array.name, bytes).columns[0].Number(0);
    return absl::OkStatus();
  }

  std::string path_;
  ZipArchive archive_;
  NpzTable table_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenNpz(const std::string& path,
                                                     const ColumnRequest& request) {
  auto archive = ZipArchive::Open(path);
  if (!archive.ok()) return archive.status();
  if (IsPysphArchive(*archive)) return OpenPysphArchive(path, *archive, request);
  auto table = ReadTable(*archive, path);
  if (!table.ok()) return table.status();
  auto plan = PlanNamedColumns(table->column_names, WithArraysExpanded(request, *table));
  if (!plan.ok()) {
    if (!table->not_plain.ok() && !NamesHoldPositions(table->column_names)) {
      return table->not_plain;
    }
    return WithPrefix(path, plan.status());
  }
  DropForeignColumns(*table, *plan);
  return std::make_unique<NpzReader>(path, *std::move(archive), *std::move(table), *std::move(plan),
                                     request);
}

}  // namespace partiemc::client::input
