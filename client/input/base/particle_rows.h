// Particles as read from a file, with all axes of the input, before the projection into a plane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/input/base/columns.h"
#include "client/input/base/particle_attribute.h"
#include "client/input/base/recorded_box.h"

namespace partiemc::client::input {

struct ParticleRows {
  std::array<std::vector<double>, 3> positions;  ///< By axis; empty without has_position.
  std::array<std::vector<float>, 3> velocities;
  std::vector<std::uint64_t> ids;
  std::vector<double> volumes;
  std::vector<ParticleAttribute> attributes;  ///< In the order of the plan.
  std::array<bool, 3> has_position = {};
  std::array<bool, 3> has_velocity = {};
  bool has_ids = false;  ///< Becomes false at the first invalid id.
  bool has_volumes = false;
  std::string volume_column;  ///< ColumnPlan::volume_name.
  bool float32 = false;
  std::optional<double> time;
  std::optional<double> step;  ///< Number of the time step.
  std::optional<RecordedBox> box;
  std::string source;
  std::size_t count = 0;
  std::size_t unselected = 0;  ///< Number of rows that do not fulfil the conditions.

  /// Clears the arrays, keeps their memory, and records which of them `plan` fills.
  void Begin(const ColumnPlan& plan);
};

/// Adds one row of a text table if it fulfils the conditions of `request`; otherwise counts it in
/// `rows.unselected`. Requires: rows.Begin(plan). Errors: kDataLoss if there are too few or too
/// many cells, if a cell is no number, or above kMaxParticles rows. An invalid id is no error; it
/// sets `rows.has_ids` to false. The caller adds the file and the line to the message.
absl::Status AppendTextRow(std::span<const std::string_view> cells, const ColumnPlan& plan,
                           const ColumnRequest& request, ParticleRows& rows);

/// The type of an element of a binary array.
enum class ElementType {
  kFloat32,
  kFloat64,
  kInt8,
  kInt16,
  kInt32,
  kInt64,
  kUInt8,
  kUInt16,
  kUInt32,
  kUInt64
};

std::size_t ElementBytes(ElementType type);

/// A column of a binary table: a view, elements `stride` bytes apart.
struct ArrayColumn {
  ElementType type = ElementType::kFloat64;
  bool swapped = false;  ///< Whether the byte order differs from this machine's.
  const char* data = nullptr;
  std::size_t stride = 0;

  double Number(std::size_t row) const;
  std::optional<std::uint64_t> Id(std::size_t row) const;
};

/// Refuses a frame of more than kMaxParticles particles with kDataLoss. Readers call it before they
/// load the arrays of a frame.
absl::Status CheckParticleCount(std::size_t count);

/// Adds the rows of a binary table that fulfil the conditions of `request`. Requires:
/// rows.Begin(plan); every column of the plan has `row_count` elements. Errors: kFailedPrecondition
/// if a condition compares a column with text; kDataLoss if `row_count` is above kMaxParticles.
absl::Status AppendArrayRows(std::span<const ArrayColumn> columns, std::size_t row_count,
                             const ColumnPlan& plan, const ColumnRequest& request,
                             ParticleRows& rows);

}  // namespace partiemc::client::input
