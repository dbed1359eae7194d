// Functions that the readers of PySPH's two formats, HDF5 and NPZ, share.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/array_table.h"
#include "client/input/base/zip_archive.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {

/// Selects the particle array to read: the one that request.columns names ("solid/x,solid/y"), else
/// "fluid", else the only one. Removes the name of the array from request.columns. Errors:
/// kFailedPrecondition with the names of the arrays.
absl::StatusOr<std::string> ChoosePysphArray(const std::vector<std::string>& names,
                                             ColumnRequest& request, const std::string& path);

/// Completes arrays and request as partiemc.read_pysph of the Python package does. Selects real
/// particles (tag 0), unless the request selects by tag. Adds an array "volume" of m / rho if there
/// is none. Requires: all arrays have `rows` rows.
void CompletePysphArrays(std::size_t rows, std::vector<StoredArray>& arrays,
                         ColumnRequest& request);

/// Whether an archive is PySPH's output: numbers and text in two pickled dicts.
bool IsPysphArchive(const ZipArchive& archive);

/// Opens an archive that IsPysphArchive accepts.
absl::StatusOr<std::unique_ptr<FrameReader>> OpenPysphArchive(const std::string& path,
                                                              const ZipArchive& archive,
                                                              const ColumnRequest& request);

}  // namespace partiemc::client::input
