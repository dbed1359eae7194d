// The .pemc format for recordings of particle frames.
//
//   mark     zstd skippable frame: "PEMCFILE", version (uint64, 1)
//   block    zstd frame with checksum: RecordingHeader
//   block    zstd frame with checksum: 1 to 8 x ParticleFrame
//   ...
//   mark     zstd skippable frame: "PEMCTAIL", number of frames (uint64)
//
// A varint with its length precedes each message. Blocks are independent, so a truncated file loses
// only its last block. The file is a valid zstd file: `zstd -dc FILE` prints the length-delimited
// messages for other Protobuf tools.
//
// Positions are float32 unless float64 is requested. float32 resolves 1e-4 of a spacing up to a
// thousand spacings from the origin and takes half of the size. Reading returns the same bits.
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
  std::string title = {};              ///< Description of the content.
};

struct RecordingOptions {
  /// Store positions as float64. With float32, a frame whose rounding error exceeds 1e-4 spacings
  /// is refused (spacing: from the header, else estimated from the box and the number of
  /// particles).
  bool float64 = false;
  /// Compression level of zstd, 1 to 19. 3 writes 200 MB/s; 19 makes files 20 % smaller and writes
  /// 2 MB/s.
  int compression_level = 3;
  /// A frame with more bytes in the recording, before compression, is refused. At most
  /// kMaxBlockBytes.
  std::size_t max_frame_bytes = std::size_t{1} << 30;
};

/// Writes a recording. Finish creates the file. Memory: one block.
class RecordingWriter {
 public:
  /// Errors: INVALID_ARGUMENT for an option or header out of range; the errors of AtomicFile.
  static absl::StatusOr<std::unique_ptr<RecordingWriter>> Create(const std::filesystem::path& path,
                                                                 const RecordingHeader& header,
                                                                 const RecordingOptions& options);
  ~RecordingWriter();

  /// Appends a frame with its arrays and its box. A triclinic box is left out, as are the bounds of
  /// axes that are not periodic. Frames are numbered in the order of calls.
  /// If a frame has no time, its velocities are left out, and its time is the number of its time
  /// step, else the number of the frame. Errors: INVALID_ARGUMENT (float32 is too coarse);
  /// RESOURCE_EXHAUSTED (more than max_frame_bytes or kMaxAttributes); the errors of AtomicFile.
  absl::Status Add(const RecordedFrame& frame);

  absl::Status Finish();

  std::uint64_t frame_count() const;

 private:
  class Impl;
  explicit RecordingWriter(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

/// Whether the file starts with the mark of a recording.
bool IsRecording(const std::string& path);

/// Reads a recording. A truncated file ends after its last complete block, with a notice; a damaged
/// block is kDataLoss. Every block is checked before its frames are delivered. Files are not
/// trusted: blocks are limited (kMaxBlockBytes, kMaxAttributes), and memory grows with their actual
/// content. Ids are returned unchanged, even if they repeat within a frame. Velocities are returned
/// only if all velocities of the frame are finite.
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
  std::vector<std::string> files() const override;
  std::vector<std::string> losses() const override { return notices(); }

 private:
  class Impl;
  explicit RecordingReader(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace partiemc::client
