// What a file format has to offer: frames of one file, one after another.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/input/columns.h"
#include "client/input/particle_rows.h"

namespace partiemc::client::input {

class FrameReader {
 public:
  virtual ~FrameReader() = default;

  /// Reads the next frame of the file into `rows`, or passes over it if `rows` is null; false at
  /// the end. Sets rows->source, and rows->time where the file tells one. After an error the reader
  /// is not used any more. Errors name the file, and the line where there is one.
  virtual absl::StatusOr<bool> Next(ParticleRows* rows) = 0;
};

/// Opens a file of one format. `request` outlives the reader.
using OpenReader = absl::StatusOr<std::unique_ptr<FrameReader>>(const std::string& path,
                                                                const ColumnRequest& request);

OpenReader OpenTextTable;   // text_table_reader.cc: CSV and other tables
OpenReader OpenLammpsDump;  // lammps_dump.cc
OpenReader OpenXyz;         // xyz.cc: element or type and x y z
OpenReader OpenNpy;         // npy_reader.cc
OpenReader OpenNpz;         // npz_reader.cc
OpenReader OpenVtk;         // vtk_reader.cc, or vtk_absent.cc in a build without VTK

}  // namespace partiemc::client::input
