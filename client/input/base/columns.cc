#include "client/input/base/columns.h"

#include <algorithm>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_join.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "partiemc/frame.h"

namespace partiemc::client::input {
namespace {

using Names = std::vector<std::string>;
using Axes = std::array<std::optional<std::size_t>, 3>;

// Normalises a name: "Pos.x [m]" -> "posx".
std::string Canonical(std::string_view name) {
  const std::size_t unit = name.find_first_of("[(");
  if (unit != std::string_view::npos && unit > 0) name = name.substr(0, unit);
  std::string canonical;
  for (const char c : name) {
    if (std::string_view(" _.:-\"'").find(c) == std::string_view::npos) {
      canonical.push_back(absl::ascii_tolower(static_cast<unsigned char>(c)));
    }
  }
  return canonical;
}

// The names of one axis of a vector: each of `stems` with the axis before or after it.
std::vector<std::string> Spellings(std::initializer_list<std::string_view> stems,
                                   std::size_t axis) {
  const std::string letter(1, "xyz"[axis]);
  std::vector<std::string> spellings;
  for (const std::string_view stem : stems) {
    for (const std::string& part : {letter, Concat(axis)}) {
      spellings.push_back(Concat(stem, part));
    }
    spellings.push_back(Concat(letter, stem));
  }
  return spellings;
}

std::optional<std::size_t> FindFirst(const Names& canonical,
                                     const std::vector<std::string>& spellings) {
  for (const std::string& spelling : spellings) {
    const auto found = std::find(canonical.begin(), canonical.end(), spelling);
    if (found != canonical.end()) return static_cast<std::size_t>(found - canonical.begin());
  }
  return std::nullopt;
}

std::ptrdiff_t CountFound(const Axes& axes) {
  return std::count_if(axes.begin(), axes.end(), [](const auto& axis) { return axis.has_value(); });
}

// Families of position columns, in order of preference.
enum class Family { kPlain, kVector, kUnwrapped, kScaled, kScaledUnwrapped };

constexpr Family kFamilies[] = {Family::kPlain, Family::kVector, Family::kUnwrapped,
                                Family::kScaled, Family::kScaledUnwrapped};

std::vector<std::string> PositionSpellings(Family family, std::size_t axis) {
  const std::string letter(1, "xyz"[axis]);
  switch (family) {
    case Family::kPlain:
      return {letter};
    case Family::kVector:
      return Spellings({"pos", "position", "positions", "point", "points", "coord", "coords",
                        "coordinate", "coordinates", "xy", "xyz"},
                       axis);
    case Family::kUnwrapped:
      return {letter + "u"};
    case Family::kScaled:
      return {letter + "s"};
    case Family::kScaledUnwrapped:
      return {letter + "su"};
  }
  return {};
}

Axes FindFamily(const Names& canonical, Family family) {
  Axes axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    axes[axis] = FindFirst(canonical, PositionSpellings(family, axis));
  }
  return axes;
}

bool IsScaled(Family family) {
  return family == Family::kScaled || family == Family::kScaledUnwrapped;
}

Axes FindVelocities(const Names& canonical) {
  Axes axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    axes[axis] = FindFirst(canonical, Spellings({"v", "vel", "velocity", "velocities"}, axis));
  }
  // Velocities in PySPH have the names "u" and "v". They are recognised only together, because a
  // single "u" or "v" can mean anything.
  const auto u = FindFirst(canonical, {"u"});
  const auto v = FindFirst(canonical, {"v"});
  if (CountFound(axes) == 0 && u && v) axes = {u, v, FindFirst(canonical, {"w"})};
  return axes;
}

std::string List(const Names& names) {
  constexpr std::size_t kShown = 12;
  const Names shown(names.begin(), names.begin() + std::min(names.size(), kShown));
  return Concat(absl::StrJoin(shown, ","), names.size() > kShown ? ",..." : "");
}

// Finds a requested column: by its exact name, by another spelling, or by its number from 1.
std::optional<std::size_t> FindAsked(const Names& names, const Names& canonical,
                                     const std::string& asked) {
  if (const auto exact = FindFirst(names, {asked})) return exact;
  if (const auto number = ParseCount(asked); number && *number >= 1 && *number <= names.size()) {
    return static_cast<std::size_t>(*number - 1);
  }
  return FindFirst(canonical, {Canonical(asked)});
}

// Plans positions in the listed columns. If all of them are axes in rising order (such as x and z),
// the positions have these axes, and recognised velocities stay. Otherwise the columns count as x,
// y and z in the listed order, and there are no velocities.
absl::Status PlanAskedPositions(const Names& names, const Names& canonical,
                                const ColumnRequest& request, ColumnPlan& plan) {
  const Names& asked = request.columns;
  if (asked.size() != 2 && asked.size() != 3) {
    return absl::FailedPreconditionError(
        Concat("--columns lists ", asked.size(),
               " columns; the file names its columns, so list the two or three that hold the "
               "positions"));
  }
  std::vector<std::size_t> found;
  for (const std::string& column : asked) {
    const auto index = FindAsked(names, canonical, column);
    if (!index) {
      return absl::FailedPreconditionError(
          Concat("there is no column '", column, "' for --columns; the columns are ", List(names)));
    }
    found.push_back(*index);
  }
  for (const Family family : kFamilies) {
    const Axes axes = FindFamily(canonical, family);
    Axes chosen;
    std::size_t next = 0;
    for (std::size_t axis = 0; axis < 3 && next < found.size(); ++axis) {
      if (axes[axis] == found[next]) chosen[axis] = found[next++];
    }
    if (next == found.size()) {
      plan.positions = chosen;
      plan.scaled = request.is_lammps_dump && IsScaled(family);
      return absl::OkStatus();
    }
  }
  for (std::size_t axis = 0; axis < found.size(); ++axis) plan.positions[axis] = found[axis];
  plan.velocities = {};
  return absl::OkStatus();
}

absl::Status PlanRecognisedPositions(const Names& names, const Names& canonical,
                                     const ColumnRequest& request, ColumnPlan& plan) {
  for (const Family family : kFamilies) {
    const Axes axes = FindFamily(canonical, family);
    if (CountFound(axes) < 2) continue;
    plan.positions = axes;
    plan.scaled = IsScaled(family);
    if (plan.scaled && !request.is_lammps_dump) {
      return absl::FailedPreconditionError(
          Concat("the only positions among ", List(names),
                 " are fractions of the box of a LAMMPS dump (xs,ys); name other columns with "
                 "--columns"));
    }
    if (family == Family::kPlain || family == Family::kScaled) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        plan.images[axis] = FindFirst(canonical, {Concat("i", "xyz"[axis])});
      }
    }
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(Concat("no position columns (x,y and the like) among ",
                                              List(names), "; name them with --columns"));
}

absl::Status PlanConditions(const Names& names, const Names& canonical,
                            const ColumnRequest& request, ColumnPlan& plan) {
  for (const Condition& condition : request.conditions) {
    const auto column = FindAsked(names, canonical, condition.column);
    if (!column) {
      return absl::FailedPreconditionError(Concat("there is no column '", condition.column,
                                                  "' to select by; the columns are ", List(names)));
    }
    plan.conditions.push_back(*column);
  }
  return absl::OkStatus();
}

// Finds the columns of a vector: NAME:0, NAME:1 and optionally NAME:2, or NAME_x, NAME_y, NAME_z.
std::vector<std::size_t> FindComponents(const Names& names, const Names& canonical,
                                        const std::string& asked) {
  const std::string stem = Canonical(asked);
  std::vector<std::size_t> found;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    auto column = FindFirst(names, {Concat(asked, ":", axis)});
    if (!column && !stem.empty()) column = FindFirst(canonical, Spellings({stem}, axis));
    if (!column) break;
    found.push_back(*column);
  }
  return found.size() < 2 ? std::vector<std::size_t>() : found;
}

absl::Status PlanAttributes(const Names& names, const Names& canonical,
                            const ColumnRequest& request, ColumnPlan& plan) {
  for (const std::string& asked : request.attributes) {
    // Velocities are no attribute here. Rows store them by axis, because the projection selects the
    // axes of the plane.
    if (asked == kVelocityAttribute && CountFound(plan.velocities) >= 2) continue;
    std::vector<std::size_t> columns = FindComponents(names, canonical, asked);
    if (const auto column = FindAsked(names, canonical, asked); column && columns.empty()) {
      columns = {*column};
    }
    if (columns.empty()) {
      return absl::FailedPreconditionError(
          Concat("there is no column '", asked, "'; the columns are ", List(names)));
    }
    plan.attributes.push_back({asked, std::move(columns)});
  }
  return absl::OkStatus();
}

Names AllCanonical(const Names& names) {
  Names canonical;
  for (const std::string& name : names) canonical.push_back(Canonical(name));
  return canonical;
}

bool AllNumbers(const Names& columns) {
  return std::all_of(columns.begin(), columns.end(),
                     [](const std::string& column) { return ParseCount(column).has_value(); });
}

// Uses a column of diameters or radii for volumes, if there is one.
void PlanSizes(const Names& canonical, ColumnPlan& plan) {
  const auto use = [&](std::optional<std::size_t> column, double size_of_length) {
    if (!column) return false;
    plan.volume = column;
    plan.size_of_length = size_of_length;
    return true;
  };
  if (use(FindFirst(canonical, {"diameter", "diameters", "particlediameter"}), 1)) return;
  use(FindFirst(canonical, {"radius", "radii", "particleradius"}), 2);
}

}  // namespace

bool Condition::Holds(std::string_view cell) const {
  if (cell == text) return true;
  if (!number) return false;
  const auto value = ParseNumber(cell);
  return value && *value == *number;
}

absl::StatusOr<ColumnRequest> ParseColumnRequest(const std::vector<std::string>& select,
                                                 std::string_view columns) {
  ColumnRequest request;
  for (const std::string& expression : select) {
    const std::string_view whole = expression;
    const std::size_t equals = std::min(whole.find('='), whole.size());
    const std::string_view column = Strip(whole.substr(0, equals));
    const std::string_view value = Strip(whole.substr(std::min(equals + 1, whole.size())));
    if (column.empty() || value.empty()) {
      return absl::InvalidArgumentError(
          Concat("--select: '", expression, "'; must be COLUMN=VALUE, for example type=1"));
    }
    request.conditions.push_back({std::string(column), std::string(value), ParseNumber(value)});
  }
  if (columns.empty()) return request;
  for (const std::string_view column : Split(columns, ',')) {
    if (column.empty()) {
      return absl::InvalidArgumentError(
          Concat("--columns: '", columns,
                 "'; must be names or numbers separated by commas, for example "
                 "x,y or 2,3"));
    }
    request.columns.emplace_back(column);
  }
  return request;
}

absl::StatusOr<ColumnPlan> PlanNamedColumns(const Names& names, const ColumnRequest& request) {
  const Names canonical = AllCanonical(names);
  ColumnPlan plan;
  plan.column_count = names.size();
  plan.in_space = request.in_space;
  plan.velocities = FindVelocities(canonical);
  plan.id = FindFirst(
      canonical, {"id", "ids", "idp", "particleid", "particleids", "originalid", "pid", "gid"});
  if (!plan.id && request.tag_is_id) plan.id = FindFirst(canonical, {"tag"});
  plan.volume = FindFirst(canonical, {"volume", "volumes", "vol", "area", "areas", "particlevolume",
                                      "particlearea", "volumetricmeasure"});
  if (request.needs_diameters) plan.per_volume = 4 / std::numbers::pi;
  if (request.needs_diameters || (request.needs_sizes && !plan.volume)) PlanSizes(canonical, plan);
  if (plan.volume) plan.volume_name = names[*plan.volume];
  const absl::Status positions = request.columns.empty()
                                     ? PlanRecognisedPositions(names, canonical, request, plan)
                                     : PlanAskedPositions(names, canonical, request, plan);
  if (!positions.ok()) return positions;
  if (absl::Status status = PlanConditions(names, canonical, request, plan); !status.ok()) {
    return status;
  }
  if (absl::Status status = PlanAttributes(names, canonical, request, plan); !status.ok()) {
    return status;
  }
  return plan;
}

absl::StatusOr<ColumnPlan> PlanUnnamedColumns(std::size_t count, const ColumnRequest& request) {
  Names names;
  ColumnRequest by_name = request;
  if (request.columns.empty()) {
    if (count != 2 && count != 3) {
      return absl::FailedPreconditionError(Concat(
          "has ", count, count == 1 ? " column" : " columns",
          " and no names; tell which are the "
          "positions with --columns, by number (2,3) or by naming the columns in their order "
          "(id,x,y)"));
    }
    names = {"x", "y", "z"};
    names.resize(count);
  } else if (AllNumbers(request.columns)) {
    for (std::size_t column = 1; column <= count; ++column) names.push_back(Concat(column));
  } else {
    if (request.columns.size() > count) {
      return absl::FailedPreconditionError(
          Concat("--columns names ", request.columns.size(), " columns, the file has ", count));
    }
    names = request.columns;
    names.resize(count, "-");
    by_name.columns.clear();
  }
  return PlanNamedColumns(names, by_name);
}

std::vector<bool> NeededColumns(const ColumnPlan& plan) {
  std::vector<bool> needed(plan.column_count, false);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (plan.positions[axis]) needed[*plan.positions[axis]] = true;
    if (plan.velocities[axis]) needed[*plan.velocities[axis]] = true;
  }
  if (plan.id) needed[*plan.id] = true;
  if (plan.volume) needed[*plan.volume] = true;
  for (const std::size_t column : plan.conditions) needed[column] = true;
  for (const AttributeColumns& attribute : plan.attributes) {
    for (const std::size_t column : attribute.columns) needed[column] = true;
  }
  return needed;
}

bool NamesHoldPositions(const Names& names) {
  const Names canonical = AllCanonical(names);
  return std::any_of(std::begin(kFamilies), std::end(kFamilies),
                     [&](Family family) { return CountFound(FindFamily(canonical, family)) >= 2; });
}

}  // namespace partiemc::client::input
