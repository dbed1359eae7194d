#include "client/input/base/particle_rows.h"

#include <algorithm>
#include <cstring>

#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

// Maximum number of bytes of a cell that an error message quotes.
constexpr std::size_t kShownCellBytes = 40;

absl::StatusOr<double> NumberOf(std::string_view cell) {
  if (const auto number = ParseNumber(cell)) return *number;
  return absl::DataLossError(Concat("'", cell.substr(0, kShownCellBytes), "' is not a number"));
}

template <typename T>
T Load(const char* bytes, bool swapped) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  T value;
  std::memcpy(&value, raw.data(), sizeof(T));
  return value;
}

template <typename Visitor>
auto Visit(const ArrayColumn& column, std::size_t row, Visitor visitor) {
  const char* const at = column.data + row * column.stride;
  switch (column.type) {
    case ElementType::kFloat32:
      return visitor(Load<float>(at, column.swapped));
    case ElementType::kInt8:
      return visitor(Load<std::int8_t>(at, column.swapped));
    case ElementType::kInt16:
      return visitor(Load<std::int16_t>(at, column.swapped));
    case ElementType::kInt32:
      return visitor(Load<std::int32_t>(at, column.swapped));
    case ElementType::kInt64:
      return visitor(Load<std::int64_t>(at, column.swapped));
    case ElementType::kUInt8:
      return visitor(Load<std::uint8_t>(at, column.swapped));
    case ElementType::kUInt16:
      return visitor(Load<std::uint16_t>(at, column.swapped));
    case ElementType::kUInt32:
      return visitor(Load<std::uint32_t>(at, column.swapped));
    case ElementType::kUInt64:
      return visitor(Load<std::uint64_t>(at, column.swapped));
    case ElementType::kFloat64:
      break;
  }
  return visitor(Load<double>(at, column.swapped));
}

absl::StatusOr<std::vector<std::size_t>> SelectedRows(std::span<const ArrayColumn> columns,
                                                      std::size_t row_count, const ColumnPlan& plan,
                                                      const ColumnRequest& request) {
  for (const Condition& condition : request.conditions) {
    if (condition.number) continue;
    return absl::FailedPreconditionError(Concat("--select ", condition.column, "=", condition.text,
                                                ": the column '", condition.column,
                                                "' holds numbers, '", condition.text, "' is none"));
  }
  std::vector<std::size_t> selected;
  selected.reserve(row_count);
  for (std::size_t row = 0; row < row_count; ++row) {
    bool holds = true;
    for (std::size_t k = 0; k < request.conditions.size(); ++k) {
      holds = holds && request.conditions[k].Holds(columns[plan.conditions[k]].Number(row));
    }
    if (holds) selected.push_back(row);
  }
  return selected;
}

}  // namespace

void ParticleRows::Begin(const ColumnPlan& plan) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    positions[axis].clear();
    velocities[axis].clear();
    has_position[axis] = plan.positions[axis].has_value();
    has_velocity[axis] = plan.velocities[axis].has_value();
  }
  ids.clear();
  volumes.clear();
  attributes.resize(plan.attributes.size());
  for (std::size_t k = 0; k < attributes.size(); ++k) {
    attributes[k].name = plan.attributes[k].name;
    attributes[k].components = static_cast<int>(plan.attributes[k].columns.size());
    attributes[k].values.clear();
  }
  has_ids = plan.id.has_value();
  has_volumes = plan.volume.has_value();
  volume_column = plan.volume_name;
  float32 = false;
  time.reset();
  step.reset();
  box.reset();
  source.clear();
  count = 0;
  unselected = 0;
}

absl::Status AppendTextRow(std::span<const std::string_view> cells, const ColumnPlan& plan,
                           const ColumnRequest& request, ParticleRows& rows) {
  if (cells.size() != plan.column_count) {
    return absl::DataLossError(Concat("the row has ", cells.size(), " of ", plan.column_count,
                                      " values; the file is truncated or damaged"));
  }
  for (std::size_t k = 0; k < request.conditions.size(); ++k) {
    if (request.conditions[k].Holds(cells[plan.conditions[k]])) continue;
    ++rows.unselected;
    return absl::OkStatus();
  }
  if (rows.count == kMaxParticles) {
    return absl::DataLossError(Concat("the frame has more than ", kMaxParticles, " particles"));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (plan.positions[axis]) {
      const auto number = NumberOf(cells[*plan.positions[axis]]);
      if (!number.ok()) return number.status();
      rows.positions[axis].push_back(*number);
    }
    if (plan.velocities[axis]) {
      const auto number = NumberOf(cells[*plan.velocities[axis]]);
      if (!number.ok()) return number.status();
      rows.velocities[axis].push_back(static_cast<float>(*number));
    }
  }
  if (plan.volume) {
    const auto number = NumberOf(cells[*plan.volume]);
    if (!number.ok()) return number.status();
    rows.volumes.push_back(plan.VolumeOf(*number));
  }
  for (std::size_t k = 0; k < plan.attributes.size(); ++k) {
    for (const std::size_t column : plan.attributes[k].columns) {
      const auto number = NumberOf(cells[column]);
      if (!number.ok()) return number.status();
      rows.attributes[k].values.push_back(static_cast<float>(*number));
    }
  }
  if (rows.has_ids) {
    const auto id = ParseId(cells[*plan.id]);
    rows.has_ids = id.has_value();
    rows.ids.push_back(id.value_or(0));
  }
  ++rows.count;
  return absl::OkStatus();
}

std::size_t ElementBytes(ElementType type) {
  switch (type) {
    case ElementType::kInt8:
    case ElementType::kUInt8:
      return 1;
    case ElementType::kInt16:
    case ElementType::kUInt16:
      return 2;
    case ElementType::kFloat32:
    case ElementType::kInt32:
    case ElementType::kUInt32:
      return 4;
    case ElementType::kFloat64:
    case ElementType::kInt64:
    case ElementType::kUInt64:
      break;
  }
  return 8;
}

double ArrayColumn::Number(std::size_t row) const {
  return Visit(*this, row, [](auto value) { return static_cast<double>(value); });
}

std::optional<std::uint64_t> ArrayColumn::Id(std::size_t row) const {
  return Visit(*this, row, [](auto value) -> std::optional<std::uint64_t> {
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      return IdOfNumber(static_cast<double>(value));
    } else {
      if (std::is_signed_v<decltype(value)> && value < 0) return std::nullopt;
      return static_cast<std::uint64_t>(value);
    }
  });
}

absl::Status CheckParticleCount(std::size_t count) {
  if (count <= kMaxParticles) return absl::OkStatus();
  return absl::DataLossError(
      Concat("the frame has ", count, " particles; at most ", kMaxParticles));
}

absl::Status AppendArrayRows(std::span<const ArrayColumn> columns, std::size_t row_count,
                             const ColumnPlan& plan, const ColumnRequest& request,
                             ParticleRows& rows) {
  if (absl::Status status = CheckParticleCount(row_count); !status.ok()) return status;
  const auto selected = SelectedRows(columns, row_count, plan, request);
  if (!selected.ok()) return selected.status();
  rows.float32 = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (plan.positions[axis]) {
      const ArrayColumn& column = columns[*plan.positions[axis]];
      rows.float32 = rows.float32 && column.type == ElementType::kFloat32;
      for (const std::size_t row : *selected) rows.positions[axis].push_back(column.Number(row));
    }
    if (plan.velocities[axis]) {
      const ArrayColumn& column = columns[*plan.velocities[axis]];
      for (const std::size_t row : *selected) {
        rows.velocities[axis].push_back(static_cast<float>(column.Number(row)));
      }
    }
  }
  if (plan.volume) {
    for (const std::size_t row : *selected) {
      rows.volumes.push_back(plan.VolumeOf(columns[*plan.volume].Number(row)));
    }
  }
  for (std::size_t k = 0; k < plan.attributes.size(); ++k) {
    for (const std::size_t row : *selected) {
      for (const std::size_t column : plan.attributes[k].columns) {
        rows.attributes[k].values.push_back(static_cast<float>(columns[column].Number(row)));
      }
    }
  }
  for (const std::size_t row : *selected) {
    if (!rows.has_ids) break;
    const auto id = columns[*plan.id].Id(row);
    rows.has_ids = id.has_value();
    rows.ids.push_back(id.value_or(0));
  }
  rows.count += selected->size();
  rows.unselected += row_count - selected->size();
  return absl::OkStatus();
}

}  // namespace partiemc::client::input
