// What a file format has to offer: frames of one file, one after another.
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

  /// Reads the next frame of the file into `rows`, or passes over it if `rows` is null; false at
  /// the end. Sets rows->source, and rows->time where the file tells one. After an error the reader
  /// is not used any more. Errors name the file, and the line where there is one.
  virtual absl::StatusOr<bool> Next(ParticleRows* rows) = 0;
};

/// Of a file that is one frame.
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
