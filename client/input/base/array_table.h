// A binary table: named columns of one length.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/base/columns.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

/// Maximum number of components of an array. An array with more is no attribute of particles and is
/// ignored.
inline constexpr std::size_t kMaxArrayComponents = 16;

struct ArrayTable {
  std::vector<std::string> names;
  std::vector<ArrayColumn> columns;  ///< Parallel to `names`.
  std::size_t rows = 0;

  /// Adds the components of an array, interleaved from `first` on: NAME, or NAME:0, NAME:1, ...
  void Add(std::string_view name, std::size_t components, ArrayColumn first);
};

/// An array of a file with `components` numbers per row, interleaved. `load` is called only if the
/// particles need the array.
struct StoredArray {
  std::string name;
  std::size_t components = 1;
  ElementType type = ElementType::kFloat64;
  bool swapped = false;
  std::function<absl::Status(std::vector<char>& bytes)> load;
};

/// Fills `rows` with the particles of `arrays`, which have `row_count` rows each. Loads only the
/// needed arrays. If request.columns has one entry, it may be the name of an array: it selects the
/// components of the array. Error messages begin with `source`, which also becomes rows.source.
absl::Status FillRows(std::span<const StoredArray> arrays, std::size_t row_count,
                      const ColumnRequest& request, const std::string& source, ParticleRows& rows);

/// Returns the index in `arrays` of the array that holds the first axis of the positions (x, or y
/// without x). Uses only request.columns.
/// Errors: as PlanNamedColumns.
absl::StatusOr<std::size_t> PositionArray(std::span<const StoredArray> arrays,
                                          const ColumnRequest& request);

/// Fills `rows` with the particles of `table`. If request.columns has one entry, it may be the name
/// of an array: it selects the components of the array. Error messages begin with `source`, which
/// also becomes rows.source.
absl::Status FillRows(const ArrayTable& table, const ColumnRequest& request,
                      const std::string& source, ParticleRows& rows);

}  // namespace partiemc::client::input
