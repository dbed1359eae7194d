// The interface of a file format: reads the frames of one file in order.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "client/input/base/columns.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

class FrameReader {
 public:
  virtual ~FrameReader() = default;

  /// Reads the next frame into `rows`, or skips it if `rows` is null. Returns false at the end.
  /// Sets rows->source, and rows->time if the file has a time. Errors state the file and, for text,
  /// the line. The reader must not be used after an error.
  virtual absl::StatusOr<bool> Next(ParticleRows* rows) = 0;
};

/// Reader of a format with one frame per file.
class OneFrameReader : public FrameReader {
 public:
  absl::StatusOr<bool> Next(ParticleRows* rows) final {
    if (std::exchange(done_, true)) return false;
    if (rows == nullptr) return true;
    if (absl::Status status = Read(*rows); !status.ok()) return status;
    return true;
  }

 protected:
  /// As Next.
  virtual absl::Status Read(ParticleRows& rows) = 0;

 private:
  bool done_ = false;
};

/// Opens a file of one format. Requires: `request` outlives the reader.
using OpenReader = absl::StatusOr<std::unique_ptr<FrameReader>>(const std::string& path,
                                                                const ColumnRequest& request);

OpenReader OpenTextTable;   // text_table_reader.cc: CSV and other tables
OpenReader OpenLammpsDump;  // lammps_dump.cc
OpenReader OpenXyz;         // xyz.cc: element or type and x y z
OpenReader OpenNpy;         // npy_reader.cc
OpenReader OpenNpz;         // npz_reader.cc
OpenReader OpenPly;         // ply.cc
OpenReader OpenGsd;         // gsd.cc
OpenReader OpenBgeo;        // bgeo.cc
OpenReader OpenHdf5;        // hdf5_reader.cc, or absent.cc in a build without HDF5
OpenReader OpenVtk;         // vtk_reader.cc, or absent.cc in a build without VTK

}  // namespace partiemc::client::input
