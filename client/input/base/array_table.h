// A binary table: named columns of one length.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/input/base/columns.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

/// Arrays with more components are no attributes of particles.
inline constexpr std::size_t kMaxArrayComponents = 16;

struct ArrayTable {
  std::vector<std::string> names;
  std::vector<ArrayColumn> columns;  ///< Parallel to `names`.
  std::size_t rows = 0;

  /// Adds the components of an array, interleaved from `first` on: NAME, or NAME:0, NAME:1, ...
  void Add(std::string_view name, std::size_t components, ArrayColumn first);
};

/// Fills `rows` with the particles of `table`. The name of an array in request.columns selects its
/// components. `source` begins errors and becomes rows.source.
absl::Status FillRows(const ArrayTable& table, const ColumnRequest& request,
                      const std::string& source, ParticleRows& rows);

}  // namespace partiemc::client::input
