// The project's own recordings of particle frames: FILE.pemc.
//
//   mark     zstd skippable frame: "PEMCFILE", version (uint64, 1)
//   block    zstd frame with checksum: RecordingHeader
//   block    zstd frame with checksum: 1 to 8 x ParticleFrame       each message behind its length,
//   ...                                                             a varint
//   mark     zstd skippable frame: "PEMCTAIL", number of frames (uint64)
//
// Every block stands alone, so that a file that was cut off loses its last block and nothing else.
// The whole is a valid zstd file: `zstd -dc FILE` gives the messages, length-delimited as other
// Protobuf tools know them.
//
// Positions are float32 unless float64 was asked for: 24 bits are 1e-4 of a spacing up to a
// thousand spacings from the origin, and half of the size. They are read back with exactly these
// bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/input/sequence.h"

namespace partiemc::client {

struct RecordingHeader {
  std::optional<double> spacing = {};  ///< Particle spacing, world units, positive.
  std::string title = {};              ///< For a person: what was recorded.
};

struct RecordingOptions {
  /// Positions as float64. Otherwise float32, and a frame that would lose more than 1e-4 spacings
  /// by it is refused (spacing: the header's, else what the frame's box and count suggest).
  bool float64 = false;
  /// Of zstd, 1 to 19. 3 writes 200 MB/s; 19 makes files 20 % smaller and writes 2 MB/s.
  int compression_level = 3;
};

/// Writes a recording; the file appears with Finish. Memory: one block.
class RecordingWriter {
 public:
  /// Errors: INVALID_ARGUMENT for an option or header out of range; those of AtomicFile.
  static absl::StatusOr<std::unique_ptr<RecordingWriter>> Create(const std::filesystem::path& path,
                                                                 const RecordingHeader& header,
                                                                 const RecordingOptions& options);
  ~RecordingWriter();

  /// Appends a frame: time, positions, ids, volumes, velocities and attributes; its index is its
  /// place in the recording. A frame without a time gets its index as time and loses its
  /// velocities, which tell nothing without one. Errors: INVALID_ARGUMENT (float32 is not enough);
  /// those of AtomicFile.
  absl::Status Add(const RecordedFrame& frame);

  absl::Status Finish();

  std::uint64_t frame_count() const;

 private:
  class Impl;
  explicit RecordingWriter(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

/// Whether the file begins as a recording does, whatever its name.
bool IsRecording(const std::string& path);

/// Reads a recording. A file that was cut off ends after its last whole block with a notice; a
/// damaged block is kDataLoss. Every block is checked before a frame of it is delivered. The file
/// is not trusted: a block is at most 1 GiB, memory grows with what is really in it. Ids are
/// delivered as they are; velocities of a frame, only where all of them are finite.
class RecordingReader final : public Sequence {
 public:
  /// `frames`, `in_space` and `max_expansion` as in SequenceOptions. Errors: as Sequence.
  static absl::StatusOr<std::unique_ptr<RecordingReader>> Open(
      const std::string& path, const std::string& frames, bool in_space = false,
      double max_expansion = input::kMaxExpansion);
  ~RecordingReader() override;

  const RecordingHeader& header() const;

  absl::StatusOr<bool> Next(RecordedFrame& frame) override;
  std::optional<std::size_t> FrameCount() override;
  std::string Description() const override;
  const std::vector<std::string>& notices() const override;

 private:
  class Impl;
  explicit RecordingReader(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace partiemc::client
