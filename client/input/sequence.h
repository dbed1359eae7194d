// Reads recorded sequences of particle frames from a file, a directory or a pattern.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/particle_attribute.h"
#include "client/input/base/recorded_box.h"

namespace partiemc::client {

/// One frame of a recording. Sequence::Next reuses its memory. Every array has the order of the
/// input.
struct RecordedFrame {
  std::size_t index = 0;  ///< Index in the input, counted from 0, before any selection.
  /// From the times file or the collection, else `step` times SequenceOptions::time_step, else as
  /// the file states it. Absent if the input has no times.
  std::optional<double> time;
  /// Number of the time step. Can replace an absent `time`, but not for velocities, which require
  /// the interval between frames.
  std::optional<double> step;
  std::string source;  ///< File and frame number, for messages.
  /// The box of the simulation, along the axes of `positions`. Absent in all formats except LAMMPS
  /// dumps, extended xyz and recordings.
  std::optional<RecordedBox> box;
  int components = 2;  ///< 3 with SequenceOptions::in_space.
  /// x, y (, z) interleaved, world units; NaN and infinity as recorded. If a file with three
  /// coordinates is read in 2D, a dropped coordinate that is not finite replaces the first one.
  std::vector<double> positions;
  bool float32 = false;  ///< The recording holds float32: a conversion to float32 is lossless.
  /// Area (in space, volume) per particle; empty if absent. Positive and finite, unless
  /// SequenceOptions::needs_sizes or needs_diameters is set.
  std::vector<float> volumes;
  std::string volume_column;  ///< The column that `volumes` come from; empty if it has no name.
  std::vector<std::uint64_t> ids;  ///< Unique within the frame; empty if absent.
  std::vector<float> velocities;   ///< Interleaved like `positions`, finite; empty if absent.
  /// The requested attributes; for a .pemc recording all of its attributes.
  std::vector<ParticleAttribute> attributes;

  std::size_t ParticleCount() const {
    return positions.size() / static_cast<std::size_t>(components);
  }
};

/// Names a particle in a message: "particle 17 (counted from 0) at (1, 2)".
std::string ParticleName(const RecordedFrame& frame, std::size_t particle);

/// Names a volume in a message: "volume of particle 17 (counted from 0) at (1, 2), by column
/// 'radius'".
std::string VolumeName(const RecordedFrame& frame, std::size_t particle);

/// Options as text from a command line. Sequence::Open refuses invalid ones with kInvalidArgument.
struct SequenceOptions {
  /// Particles to keep: "COLUMN=VALUE", for example "type=1". All expressions must hold. Values
  /// are compared as numbers if both are numbers, otherwise as text.
  std::vector<std::string> select = {};

  /// Columns, separated by commas; empty: recognised by their names.
  /// - Files with column names (CSV header, LAMMPS dump, NPZ): the two or three columns of the
  ///   positions, by name or by number from 1: "xu,yu", "Points:0,Points:2", "8,10".
  /// - Files without names (CSV without header, NPY): the numbers of the two or three columns of
  ///   the positions, "2,3", or names for the first columns in order, "id,x,y,vx,vy"; the name "-"
  ///   skips a column.
  /// - HDF5: datasets, "PartType0/Coordinates" or "run/x,run/y"; "*" in a path stands for the
  ///   groups of the frames, "data/*/particles/fluid/position". PySPH: "NAME/x,NAME/y" chooses
  ///   the particle array NAME instead of fluid.
  /// - VTK files define their positions; the option is refused.
  std::string columns = {};

  /// Particle attributes to read: column names, or arrays of two or three components. "velocity"
  /// selects `velocities`. A file without one of the attributes is refused.
  std::vector<std::string> attributes = {};

  /// Read volumes from a column of diameters d or radii r if there is none of volumes: d^2, (2
  /// r)^2; with `in_space` d^3, (2 r)^3. Wrong volumes stay in the frame, so that it is refused;
  /// without this option, they are ignored.
  bool needs_sizes = false;

  /// Read volumes for grains, which are squared diameters: from a column of diameters or radii,
  /// else from a column of volumes, which are areas A of discs: 4 A / pi. Wrong volumes stay.
  bool needs_diameters = false;

  /// Keep all three coordinates of 3D particles. A file with two coordinates is refused.
  bool in_space = false;

  /// CSV file of frame times: columns `frame` (0-based index in the input) and `t` or `time`, or a
  /// single column of times, one line per frame. Empty: `times.csv` beside the files, if present. A
  /// frame without a time in it is refused.
  std::string times = {};

  /// Duration of a time step, for formats that state a step number for each frame (LAMMPS, GSD). A
  /// frame without a step number is refused. Excludes `times`; a `times.csv` beside the files is
  /// not used.
  std::optional<double> time_step = {};

  /// "A:B" or "A:B:STEP": frames A, A + STEP, ... below B; each part is optional. "A" is one
  /// frame. Empty: all.
  std::string frames = {};

  /// Largest ratio of unpacked to packed bytes of a file. A file may always unpack to 64 MiB.
  double max_expansion = input::kMaxExpansion;
};

/// The frames of one input, in natural order of the file names. Not thread-safe.
///
/// Reads, plain or packed (.gz, .zst): CSV and other text tables, LAMMPS text dumps, LAMMPS and
/// extended xyz, PLY, BGEO. Reads also NPY, NPZ and GSD. Builds with VTK read legacy VTK, VTP, VTU.
/// Builds with HDF5 read HDF5 of PySPH, H5Part, VTKHDF, openPMD and Gadget. ParaView's collections
/// .pvd and .series list files and their times.
///
/// In a LAMMPS dump the positions are x y (wrapped), else xu yu (unwrapped), else xs ys (scaled).
/// Image flags ix iy iz unwrap x y and xs ys, unless `columns` names the positions.
///
/// Data with three coordinates is 2D if one axis is constant to 1e-6 of the largest extent. The
/// first frame with particles determines this axis; the other two axes become x and y in this
/// order. If several axes are constant, the last of them is dropped. A later frame outside the
/// plane is an error.
///
/// Errors are one line with the problem, the place (file, line, frame) and the remedy.
/// kInvalidArgument: a wrong option. kNotFound, kPermissionDenied: the file. kUnimplemented: an
/// unsupported format. kFailedPrecondition: the input is ambiguous (several series, columns without
/// names, 3D), or `select` holds for no particle of any frame. kDataLoss: damaged or truncated
/// input. kResourceExhausted: the input unpacks to too many bytes. Files are not trusted: memory
/// grows with the bytes read, never with a declared count.
class Sequence {
 public:
  /// Finds the files, recognises their format and reads the beginning of the first one.
  /// `input`: a file, a collection, a directory, or a pattern with * ? [ ].
  static absl::StatusOr<std::unique_ptr<Sequence>> Open(const std::string& input,
                                                        const SequenceOptions& options);
  virtual ~Sequence() = default;

  /// Reads the next frame. Returns false at the end; `frame` is then unspecified. After an error
  /// every call returns this error.
  virtual absl::StatusOr<bool> Next(RecordedFrame& frame) = 0;

  /// The number of frames that Next returns in all, if it is cheap to determine: one frame per
  /// file, a count in the file, or files below 64 MiB together, which are scanned once.
  virtual std::optional<std::size_t> FrameCount() = 0;

  /// A short description of the input: "75 CSV files, frame_0000.csv to frame_0074.csv".
  virtual std::string Description() const = 0;

  /// Notices for the user: skipped files, the recognised plane, ignored arrays. Next may add
  /// notices.
  virtual const std::vector<std::string>& notices() const = 0;

  /// The files that Next reads, and the file of times.
  virtual std::vector<std::string> files() const = 0;

  /// The notices of input that is missing in the results: lost frames, for example of a truncated
  /// recording, and ignored arrays. The caller should show them even if it shows nothing else.
  virtual std::vector<std::string> losses() const { return {}; }
};

}  // namespace partiemc::client
