#include "client/input/base/array_table.h"

#include <algorithm>

#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

// "--columns pos" with the name of an array selects its components.
ColumnRequest WithComponents(const ColumnRequest& request, const ArrayTable& table) {
  ColumnRequest expanded = request;
  if (request.columns.size() != 1) return expanded;
  std::vector<std::string> components;
  for (const std::string& name : table.names) {
    if (name == Concat(request.columns[0], ":", components.size())) components.push_back(name);
  }
  if (!components.empty()) expanded.columns = std::move(components);
  return expanded;
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

}  // namespace partiemc::client::input
