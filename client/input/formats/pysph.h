// What the two formats of PySPH's output, HDF5 and NPZ, have in common.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/array_table.h"
#include "client/input/base/zip_archive.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {

/// Selects the particle array to read: that of request.columns ("solid/x,solid/y"; the array is
/// removed from the names), else "fluid", else the only one. Errors: kFailedPrecondition, with the
/// names.
absl::StatusOr<std::string> ChoosePysphArray(const std::vector<std::string>& names,
                                             ColumnRequest& request, const std::string& path);

/// As partiemc.read_pysph of the Python package: keeps real particles only (tag 0), and adds
/// volumes m / rho. Requires: all arrays have `rows` rows. The arrays must outlive the result.
void CompletePysphArrays(std::size_t rows, std::vector<StoredArray>& arrays,
                         ColumnRequest& request);

/// Whether an archive is PySPH's output: numbers and text in two pickled dicts.
bool IsPysphArchive(const ZipArchive& archive);

/// Opens such an archive.
absl::StatusOr<std::unique_ptr<FrameReader>> OpenPysphArchive(const std::string& path,
                                                              const ZipArchive& archive,
                                                              const ColumnRequest& request);

}  // namespace partiemc::client::input
