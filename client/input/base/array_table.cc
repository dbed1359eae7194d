#include "client/input/base/array_table.h"

#include <algorithm>

#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

// Expands the name of an array: if --columns has only this name, replaces it by the names of the
// array's components.
ColumnRequest WithComponents(const ColumnRequest& request, const ArrayTable& table) {
  ColumnRequest expanded = request;
  if (request.columns.size() != 1) return expanded;
  std::vector<std::string> components;
  for (const std::string& name : table.names) {
    if (components.size() == 3) break;
    const std::string stem = Concat(request.columns[0], ":");
    if (name == Concat(stem, components.size()) || name == Concat(stem, "xyz"[components.size()])) {
      components.push_back(name);
    }
  }
  if (!components.empty()) expanded.columns = std::move(components);
  return expanded;
}

// The columns of `arrays`, with null instead of data.
ArrayTable NamesOf(std::span<const StoredArray> arrays) {
  ArrayTable table;
  for (const StoredArray& array : arrays) {
    table.Add(array.name, array.components,
              {array.type, array.swapped, nullptr, array.components * ElementBytes(array.type)});
  }
  return table;
}

}  // namespace

void ArrayTable::Add(std::string_view name, std::size_t components, ArrayColumn first) {
  for (std::size_t k = 0; k < components; ++k) {
    names.push_back(components == 1 ? std::string(name) : Concat(name, ":", k));
    columns.push_back(first);
    if (first.data != nullptr) first.data += ElementBytes(first.type);
  }
}

absl::Status FillRows(const ArrayTable& table, const ColumnRequest& request,
                      const std::string& source, ParticleRows& rows) {
  const auto plan = PlanNamedColumns(table.names, WithComponents(request, table));
  if (!plan.ok()) return WithPrefix(source, plan.status());
  rows.Begin(*plan);
  rows.source = source;
  const absl::Status status = AppendArrayRows(table.columns, table.rows, *plan, request, rows);
  return status.ok() ? status : WithPrefix(source, status);
}

absl::StatusOr<std::size_t> PositionArray(std::span<const StoredArray> arrays,
                                          const ColumnRequest& request) {
  const ArrayTable table = NamesOf(arrays);
  // Attributes and conditions are left out, because the caller may add arrays for them later.
  const ColumnRequest columns{.columns = request.columns};
  const auto plan = PlanNamedColumns(table.names, WithComponents(columns, table));
  if (!plan.ok()) return plan.status();
  std::size_t column = 0;
  for (const auto& position : plan->positions) {
    if (!position) continue;
    column = *position;
    break;
  }
  std::size_t array = 0;
  while (column >= arrays[array].components) column -= arrays[array++].components;
  return array;
}

absl::Status FillRows(std::span<const StoredArray> arrays, std::size_t row_count,
                      const ColumnRequest& request, const std::string& source, ParticleRows& rows) {
  if (row_count > kMaxParticles) {
    return absl::DataLossError(
        Concat(source, ": has ", row_count, " particles; at most ", kMaxParticles));
  }
  ArrayTable table = NamesOf(arrays);
  table.rows = row_count;
  const auto plan = PlanNamedColumns(table.names, WithComponents(request, table));
  if (!plan.ok()) return WithPrefix(source, plan.status());
  const std::vector<bool> needed = NeededColumns(*plan);
  std::vector<std::vector<char>> bytes(arrays.size());
  std::size_t first = 0;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    const std::size_t count = arrays[k].components;
    bool load = false;
    for (std::size_t c = 0; c < count; ++c) load = load || needed[first + c];
    if (load) {
      if (absl::Status status = arrays[k].load(bytes[k]); !status.ok()) return status;
    }
    for (std::size_t c = 0; c < count && !bytes[k].empty(); ++c) {
      table.columns[first + c].data = bytes[k].data() + c * ElementBytes(arrays[k].type);
    }
    first += count;
  }
  return FillRows(table, request, source, rows);
}

}  // namespace partiemc::client::input
