// Finds the frames of HDF5 files of PySPH, H5Part, VTKHDF, openPMD and Gadget, and of other
// programs by the names of their datasets.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/hdf5_file.h"

namespace partiemc::client::input {

/// A dataset, or a range of its rows, that holds one array of a frame.
struct Hdf5Column {
  std::string name;
  std::string dataset;
  std::uint64_t begin = 0;
  std::optional<std::uint64_t> count = {};  ///< All rows if absent.
};

/// A frame: a group of arrays with one row per particle.
struct Hdf5Frame {
  std::string place;  ///< For messages: a group, or "step 3".
  std::string group;  ///< The group of its arrays; empty if `columns` lists them.
  std::vector<Hdf5Column> columns;
  std::optional<double> time;
  std::optional<double> step;
};

/// The frames of a file, and the columns to read.
struct Hdf5Content {
  std::vector<Hdf5Frame> frames;
  ColumnRequest request;  ///< With names relative to the group of a frame.
  bool pysph = false;     ///< The file is PySPH's output.
};

/// Finds the frames of a file. Reads no arrays of particles. Errors: kFailedPrecondition with the
/// names of datasets if the kind of the file is not known, or if `request` names no group of it;
/// kDataLoss if the file is damaged.
absl::StatusOr<Hdf5Content> FindHdf5Frames(const Hdf5File& file, const ColumnRequest& request);

}  // namespace partiemc::client::input
