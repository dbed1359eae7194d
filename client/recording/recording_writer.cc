#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/output/atomic_file.h"
#include "client/recording/block.h"
#include "client/recording/recording.h"
#include "partiemc/recording/v1/recording.pb.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/bytes.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

// Maximum number of frames per block: a compromise between the frames that a truncation loses and
// the size. The bundled dam break takes 1.89 MB with 8 frames per block, 2.16 MB with 1, 1.73 MB in
// one block.
constexpr int kFramesPerBlock = 8;
// A block of this size gets no more frames: large frames do not compress better together.
constexpr std::size_t kFullBlockBytes = std::size_t{8} << 20;

constexpr double kPrecisionSpacings = 1e-4;

void AppendDelimited(const google::protobuf::MessageLite& message, std::string& out) {
  google::protobuf::io::StringOutputStream stream(&out);
  google::protobuf::util::SerializeDelimitedToZeroCopyStream(message, &stream);
}

// Estimates the spacing of a frame under two assumptions: the particles fill their bounding box
// evenly, or they lie on a line along it. Returns the larger estimate, or 0 for an empty box.
double SuggestedSpacing(const RecordedFrame& frame) {
  const auto axes = static_cast<std::size_t>(frame.components);
  const double count = static_cast<double>(frame.ParticleCount());
  double content = 1, longest = 0;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    double min = INFINITY, max = -INFINITY;
    for (std::size_t k = axis; k < frame.positions.size(); k += axes) {
      if (!std::isfinite(frame.positions[k])) continue;
      min = std::min(min, frame.positions[k]);
      max = std::max(max, frame.positions[k]);
    }
    if (!(max >= min)) return 0;
    content *= max - min;
    longest = std::max(longest, max - min);
  }
  const double each = content / count;
  return std::max(axes == 2 ? std::sqrt(each) : std::cbrt(each), longest / count);
}

}  // namespace

class RecordingWriter::Impl {
 public:
  Impl(AtomicFile file, const RecordingHeader& header, const RecordingOptions& options)
      : file_(std::move(file)),
        spacing_(header.spacing),
        float64_(options.float64),
        max_frame_bytes_(options.max_frame_bytes),
        packer_(options.compression_level) {}

  absl::Status Begin(const RecordingHeader& header) {
    const absl::Status marked =
        file_.Append(recording::MakeMark(recording::kFileTag, recording::kVersion));
    if (!marked.ok()) return marked;
    partiemc::recording::v1::RecordingHeader message;
    if (header.spacing) message.set_spacing(*header.spacing);
    message.set_title(header.title);
    AppendDelimited(message, block_);
    return WriteBlock();
  }

  absl::Status Add(const RecordedFrame& frame) {
    if (frame.attributes.size() > recording::kMaxAttributes) {
      return absl::ResourceExhaustedError(
          absl::StrCat(frame.source, ": has ", frame.attributes.size(),
                       " attributes; a recording holds at most ", recording::kMaxAttributes));
    }
    message_.set_sequence(frame_count_);
    message_.set_time(frame.time.value_or(frame.step.value_or(static_cast<double>(frame_count_))));
    const absl::Status status = SetPositions(frame);
    if (!status.ok()) return status;
    wire::AssignBytes(std::span<const std::uint64_t>(frame.ids), *message_.mutable_ids());
    wire::AssignBytes(std::span<const float>(frame.volumes), *message_.mutable_volumes());
    // Without a time, the interval between frames is unknown, so velocities are dropped.
    wire::AssignBytes(
        frame.time ? std::span<const float>(frame.velocities) : std::span<const float>(),
        *message_.mutable_velocities());
    SetBox(frame.box);
    message_.clear_scalars();
    for (const ParticleAttribute& attribute : frame.attributes) {
      v1::NamedScalar& scalar = *message_.add_scalars();
      scalar.set_name(attribute.name);
      scalar.set_components(static_cast<std::uint32_t>(attribute.components));
      wire::AssignBytes(std::span<const float>(attribute.values), *scalar.mutable_values());
    }
    // Protobuf serialises no message above 2 GiB.
    if (const std::size_t bytes = message_.ByteSizeLong(); bytes > max_frame_bytes_) {
      return absl::ResourceExhaustedError(absl::StrCat(
          frame.source, ": has ", bytes, " bytes; a recording holds at most ", max_frame_bytes_));
    }
    AppendDelimited(message_, block_);
    ++frame_count_;
    ++block_frames_;
    if (block_frames_ == kFramesPerBlock || block_.size() >= kFullBlockBytes) return WriteBlock();
    return absl::OkStatus();
  }

  absl::Status Finish() {
    absl::Status status = block_.empty() ? absl::OkStatus() : WriteBlock();
    if (!status.ok()) return status;
    status = file_.Append(recording::MakeMark(recording::kTailTag, frame_count_));
    return status.ok() ? file_.Commit() : status;
  }

  std::uint64_t frame_count() const { return frame_count_; }

 private:
  void SetBox(const std::optional<RecordedBox>& box) {
    message_.clear_box();
    if (!box || box->is_tilted) return;
    PeriodicBox periodic;
    for (std::size_t k = 0; k < periodic.axes.size(); ++k) {
      // A dump of 2D data may have a periodic axis without extent.
      if (box->is_periodic[k] && box->length[k] > 0) {
        periodic.axes[k] = PeriodicAxis{box->low[k], box->length[k]};
      }
    }
    *message_.mutable_box() = wire::ToWire(periodic);
  }

  absl::Status SetPositions(const RecordedFrame& frame) {
    const bool in_space = frame.components == 3;
    if (float64_) {
      message_.set_position_format(in_space ? v1::POSITION_FORMAT_FLOAT64_3
                                            : v1::POSITION_FORMAT_FLOAT64_2);
      wire::AssignBytes(std::span<const double>(frame.positions), *message_.mutable_positions());
      return absl::OkStatus();
    }
    positions_.resize(frame.positions.size());
    double worst = 0;
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      positions_[k] = static_cast<float>(frame.positions[k]);
      const double lost = std::abs(frame.positions[k] - static_cast<double>(positions_[k]));
      if (std::isfinite(frame.positions[k])) worst = std::max(worst, lost);
    }
    if (worst > 0) {
      const double spacing = spacing_.value_or(SuggestedSpacing(frame));
      if (worst > kPrecisionSpacings * spacing) {
        return ViolationError(
            absl::StatusCode::kInvalidArgument,
            {.reason = "RESOLUTION",
             .field = absl::StrCat(frame.source, ": positions"),
             .value = absl::StrCat("float32 would move a particle by ", ShortestNumber(worst)),
             .rule = absl::StrCat("at most 1e-4 spacings of ", ShortestNumber(spacing),
                                  " are lost: write them with --float64")});
      }
    }
    message_.set_position_format(in_space ? v1::POSITION_FORMAT_FLOAT32_3
                                          : v1::POSITION_FORMAT_FLOAT32_2);
    wire::AssignBytes(std::span<const float>(positions_), *message_.mutable_positions());
    return absl::OkStatus();
  }

  absl::Status WriteBlock() {
    const auto packed = packer_.Pack(block_);
    block_.clear();
    block_frames_ = 0;
    return packed.ok() ? file_.Append(*packed) : packed.status();
  }

  AtomicFile file_;
  const std::optional<double> spacing_;
  const bool float64_;
  const std::size_t max_frame_bytes_;
  recording::BlockPacker packer_;
  v1::ParticleFrame message_;
  std::vector<float> positions_;
  std::string block_;
  int block_frames_ = 0;
  std::uint64_t frame_count_ = 0;
};

absl::StatusOr<std::unique_ptr<RecordingWriter>> RecordingWriter::Create(
    const std::filesystem::path& path, const RecordingHeader& header,
    const RecordingOptions& options) {
  if (header.spacing && !(*header.spacing > 0 && std::isfinite(*header.spacing))) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {.reason = std::string(kReasonOutOfRange),
                           .field = "spacing",
                           .value = ShortestNumber(*header.spacing),
                           .rule = "must be positive and finite"});
  }
  if (options.compression_level < 1 || options.compression_level > 19) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {.reason = std::string(kReasonOutOfRange),
                           .field = "compression_level",
                           .value = absl::StrCat(options.compression_level),
                           .rule = "must be in [1, 19]"});
  }
  if (options.max_frame_bytes > recording::kMaxBlockBytes) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {.reason = std::string(kReasonOutOfRange),
                           .field = "max_frame_bytes",
                           .value = absl::StrCat(options.max_frame_bytes),
                           .rule = absl::StrCat("must be at most ", recording::kMaxBlockBytes)});
  }
  auto file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  auto impl = std::make_unique<Impl>(*std::move(file), header, options);
  const absl::Status begun = impl->Begin(header);
  if (!begun.ok()) return begun;
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(impl)));
}

RecordingWriter::RecordingWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordingWriter::~RecordingWriter() = default;

absl::Status RecordingWriter::Add(const RecordedFrame& frame) { return impl_->Add(frame); }
absl::Status RecordingWriter::Finish() { return impl_->Finish(); }
std::uint64_t RecordingWriter::frame_count() const { return impl_->frame_count(); }

}  // namespace partiemc::client
