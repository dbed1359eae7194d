// Assigns meanings to the columns of a table, by their names or by options.
//
// All formats are treated as tables: an array of two or three components has the columns "name:0",
// "name:1", "name:2".
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

/// One of SequenceOptions::select.
struct Condition {
  std::string column;
  std::string text;
  std::optional<double> number;  ///< `text` as a number, if it is one.

  bool Holds(std::string_view cell) const;
  bool Holds(double cell) const { return number.has_value() && cell == *number; }
};

/// The options about columns.
struct ColumnRequest {
  std::vector<Condition> conditions;
  std::vector<std::string> attributes;   ///< SequenceOptions::attributes.
  std::vector<std::string> columns;      ///< SequenceOptions::columns, split; empty: by names.
  double max_expansion = kMaxExpansion;  ///< SequenceOptions::max_expansion.
  bool tag_is_id = true;                 ///< Whether a column "tag" can hold the ids.
  bool is_lammps_dump = false;           ///< Whether columns "xs" are fractions of a box.
  bool needs_sizes = false;              ///< SequenceOptions::needs_sizes.
  bool in_space = false;                 ///< SequenceOptions::in_space.
  bool needs_diameters = false;          ///< SequenceOptions::needs_diameters.
};

/// Parses the options --select and --columns. kInvalidArgument if an expression is not
/// "COLUMN=VALUE" or an entry of `columns` is empty.
absl::StatusOr<ColumnRequest> ParseColumnRequest(const std::vector<std::string>& select,
                                                 std::string_view columns);

/// The columns of an attribute, one per component, 1 to 3.
struct AttributeColumns {
  std::string name;
  std::vector<std::size_t> columns;
};

/// The meaning of each column. Axes are the x, y, z of the input.
struct ColumnPlan {
  std::array<std::optional<std::size_t>, 3> positions;  ///< Two or three are set.
  std::array<std::optional<std::size_t>, 3> velocities;
  std::optional<std::size_t> id;
  std::optional<std::size_t> volume;
  std::string volume_name;  ///< Name of the column `volume`, for messages.
  /// If not 0, `volume` is a column of lengths: a volume is the square, in space the cube, of
  /// size_of_length times the length.
  double size_of_length = 0;
  bool in_space = false;
  double per_volume = 1;  ///< Factor of the values in a column of volumes.
  std::vector<AttributeColumns> attributes;
  std::vector<std::size_t> conditions;  ///< Parallel to ColumnRequest::conditions.
  /// Columns ix iy iz of LAMMPS (image flags): how often the particle has crossed the periodic box
  /// along each axis. Not set if ColumnRequest::columns names the positions, which then stay as
  /// they are.
  std::array<std::optional<std::size_t>, 3> images;
  std::size_t column_count = 0;
  bool scaled = false;  ///< Positions are LAMMPS's xs ys zs: fractions of the box.

  /// The volume that a value of the column of volumes stands for.
  double VolumeOf(double value) const {
    if (size_of_length == 0) return per_volume * value;
    if (!(value > 0)) return value;  // The square of a negative length would be positive.
    const double size = size_of_length * value;
    return in_space ? size * size * size : size * size;
  }
};

/// Makes a plan for a table with column names. Recognises x, Pos.x, Points:0, Position_X, xu, xs,
/// vx, Vel:0, velocity_x, id, idp, particle_id, volume, vol, area and similar names, in upper or
/// lower case, with any of " _.:-" between the parts and an optional unit in brackets. An attribute
/// is a column with its name, or an array NAME:0, NAME:1 or NAME_x, NAME_y; "velocity" means the
/// velocities. Errors: kFailedPrecondition without positions or without a requested column, and if
/// the only positions are fractions of a box (xs ys) outside of a LAMMPS dump. If
/// ColumnRequest::columns names such columns there, they are used as coordinates.
absl::StatusOr<ColumnPlan> PlanNamedColumns(const std::vector<std::string>& names,
                                            const ColumnRequest& request);

/// Makes a plan for a table of `count` columns without names: two are x y, three are x y z; other
/// tables need request.columns.
absl::StatusOr<ColumnPlan> PlanUnnamedColumns(std::size_t count, const ColumnRequest& request);

/// Marks the columns of the table that a plan uses, except `images`.
std::vector<bool> NeededColumns(const ColumnPlan& plan);

/// Whether PlanNamedColumns would find positions by names alone.
bool NamesHoldPositions(const std::vector<std::string>& names);

}  // namespace partiemc::client::input
