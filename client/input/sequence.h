// Recorded sequences of particle frames: a file, a directory or a pattern in, frame after frame
// out.
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

namespace partiemc::client {

/// One frame of a recording. Owns its memory, which is reused when the same object is passed to
/// Sequence::Next again. Every array has the order of the input.
struct RecordedFrame {
  std::size_t index = 0;       ///< 0-based index in the input, also when a range is selected.
  std::optional<double> time;  ///< Times file, else the frame's own time; a time step is no time.
  std::string source;          ///< File, and the frame within it, for messages.
  int components = 2;          ///< 3 with SequenceOptions::in_space.
  /// x, y (, z) interleaved, world units; NaN and infinity as recorded.
  std::vector<double> positions;
  bool float32 = false;  ///< The recording holds float32, so that `positions` lost nothing.
  std::vector<float>
      volumes;  ///< Area (in space volume) per particle, all positive and finite; empty if none.
  std::vector<std::uint64_t> ids;  ///< Unique within the frame; empty if none.
  std::vector<float> velocities;   ///< Interleaved as `positions`, finite; empty if none.
  /// Those that were asked for; of a recording of our own, all that it has.
  std::vector<ParticleAttribute> attributes;

  std::size_t ParticleCount() const {
    return positions.size() / static_cast<std::size_t>(components);
  }
};

/// What to read of an input. All of it is text as a person writes it on a command line; what cannot
/// be understood is refused by Sequence::Open with kInvalidArgument.
struct SequenceOptions {
  /// Particles to keep: "COLUMN=VALUE", for example "type=1". All expressions must hold. A value
  /// equals a cell if both read as the same number, else if they are the same text.
  std::vector<std::string> select = {};

  /// Columns, separated by commas; empty: recognised by their names.
  /// - The file names its columns (CSV header, LAMMPS dump, NPZ): two or three columns that hold
  ///   the positions, by name or by number, counted from 1: "xu,yu", "Points:0,Points:2", "8,10".
  /// - It does not (CSV without header, NPY): either the numbers of the two or three columns of
  ///   the positions, "2,3", or names for the first columns in their order, "id,x,y,vx,vy";
  ///   a column named "-" is ignored.
  /// VTK files know where their positions are; the option is refused for them.
  std::string columns = {};

  /// What else is wanted of each particle: columns of these names, or arrays of two or three
  /// components; "velocity" are `velocities`. A file that lacks one is refused.
  std::vector<std::string> attributes = {};

  /// Keep all three coordinates, of particles that fill space. A file of two is refused.
  bool in_space = false;

  /// CSV file of frame times: columns `frame` (0-based index in the input) and `t` or `time`, or a
  /// single column of times, one line per frame. Empty: `times.csv` beside the files, if it is one.
  std::string times = {};

  /// "A:B" or "A:B:STEP": frames A, A + STEP, ... below B; each part may be left out. "A" is one
  /// frame. Empty: all.
  std::string frames = {};

  /// A packed file may unpack to 64 MiB, and to this many times its size beyond.
  double max_expansion = input::kMaxExpansion;
};

/// Frames of one input, read one at a time in natural order of the file names. Not thread safe.
///
/// Reads CSV and other text tables, LAMMPS text dumps and LAMMPS xyz (each plain, .gz or .zst),
/// NPY, NPZ, and, where built with VTK, legacy VTK, VTP and VTU. Of several kinds of positions in a
/// LAMMPS dump it takes x y (wrapped), else xu yu (unwrapped), else xs ys (scaled).
///
/// Three-component data is 2D where one axis is constant to 1e-6 of the largest extent. The first
/// frame that has particles decides which; the other two axes become x and y, in this order.
/// If several axes are constant, the last of them is dropped. A later frame that leaves the plane
/// is an error.
///
/// Errors are one line with the problem, the place (file, line, frame) and the remedy:
/// kInvalidArgument: a wrong option; kNotFound, kPermissionDenied: the file; kUnimplemented: an
/// unsupported format; kFailedPrecondition: the input is ambiguous (several series, columns without
/// names, 3D); kDataLoss: damaged or truncated input; kResourceExhausted: it unpacks to too much.
/// Files are not trusted: memory grows with the bytes read, never with a declared count.
class Sequence {
 public:
  /// Finds the files, recognises their format and reads the beginning of the first one.
  /// `input`: a file, a directory, or a pattern with * ? [ ].
  static absl::StatusOr<std::unique_ptr<Sequence>> Open(const std::string& input,
                                                        const SequenceOptions& options);
  virtual ~Sequence() = default;

  /// Reads the next frame. False at the end, `frame` is then unspecified. After an error, every
  /// call returns this error; frames before it were delivered.
  virtual absl::StatusOr<bool> Next(RecordedFrame& frame) = 0;

  /// How many frames Next delivers in all, where that is cheap to know: one frame per file, or
  /// files small enough to be scanned (below 64 MiB together, a fraction of a second, once).
  virtual std::optional<std::size_t> FrameCount() = 0;

  /// What was found, in a few words: "75 CSV files, frame_0000.csv to frame_0074.csv".
  virtual std::string Description() const = 0;

  /// What a person should know: files skipped, plane recognised, arrays ignored. Grows with Next.
  virtual const std::vector<std::string>& notices() const = 0;
};

/// Order of names as people number them: runs of digits compare by value, "frame_2" < "frame_10".
/// A strict weak order; names that differ only in leading zeros are ordered by them.
bool NaturalLess(std::string_view a, std::string_view b);

}  // namespace partiemc::client
