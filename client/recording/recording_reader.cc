#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/input/frame_range.h"
#include "client/recording/block.h"
#include "client/recording/recording.h"
#include "partiemc/recording/v1/recording.pb.h"
#include "partiemc/status.h"
#include "partiemc/v1/reconstruction.pb.h"
#include "wire/bytes.h"
#include "wire/codec.h"

namespace partiemc::client {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using recording::BlockReader;

// Limit on the fields of a message, nested and unknown ones included. An attribute is a field with
// three fields.
constexpr std::size_t kMaxFields = 4 * recording::kMaxAttributes + 64;

absl::Status CheckBytes(const char* field, std::size_t size, std::size_t expected) {
  if (size == 0 || size == expected) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat(field, " has ", size, " bytes where ", expected, " are due"));
}

absl::Status CopyPositions(const v1::ParticleFrame& message, RecordedFrame& frame) {
  const std::string& bytes = message.positions();
  const v1::PositionFormat format = message.position_format();
  frame.float32 =
      format == v1::POSITION_FORMAT_FLOAT32_2 || format == v1::POSITION_FORMAT_FLOAT32_3;
  frame.components =
      format == v1::POSITION_FORMAT_FLOAT32_3 || format == v1::POSITION_FORMAT_FLOAT64_3 ? 3 : 2;
  if (!frame.float32 && frame.components == 2 && format != v1::POSITION_FORMAT_FLOAT64_2) {
    return absl::DataLossError("positions have an unknown format");
  }
  const std::size_t particle_bytes =
      static_cast<std::size_t>(frame.components) * (frame.float32 ? sizeof(float) : sizeof(double));
  if (bytes.size() % particle_bytes != 0) {
    return absl::DataLossError(
        absl::StrCat("positions have ", bytes.size(), " bytes, no multiple of ", particle_bytes));
  }
  if (frame.float32) {
    const auto view = wire::ViewBytes<float>(bytes);
    frame.positions.assign(view.begin(), view.end());
  } else {
    wire::CopyBytes(bytes, frame.positions);
  }
  return absl::OkStatus();
}

absl::Status CopyAttributes(const v1::ParticleFrame& message, RecordedFrame& frame) {
  frame.attributes.resize(static_cast<std::size_t>(message.scalars_size()));
  for (std::size_t k = 0; k < frame.attributes.size(); ++k) {
    const v1::NamedScalar& scalar = message.scalars(static_cast<int>(k));
    const std::uint32_t components = std::max(scalar.components(), 1u);
    if (components > 3) return absl::DataLossError("a scalar has more than three components");
    const std::size_t bytes = 4 * components * frame.ParticleCount();
    if (scalar.values().size() != bytes) {
      return absl::DataLossError(absl::StrCat("a scalar has ", scalar.values().size(),
                                              " bytes where ", bytes, " are due"));
    }
    ParticleAttribute& attribute = frame.attributes[k];
    attribute.name = scalar.name();
    attribute.components = static_cast<int>(components);
    wire::CopyBytes(scalar.values(), attribute.values);
  }
  return absl::OkStatus();
}

absl::Status CopyBox(const v1::ParticleFrame& message, RecordedFrame& frame) {
  frame.box.reset();
  if (!message.has_box()) return absl::OkStatus();
  const PeriodicBox box = wire::FromWire(message.box());
  RecordedBox recorded;
  for (std::size_t k = 0; k < box.axes.size(); ++k) {
    if (!box.axes[k]) continue;
    const auto [origin, length] = *box.axes[k];
    if (!std::isfinite(origin) || !(length > 0) || !std::isfinite(origin + length)) {
      return absl::DataLossError("a length of the box is not positive and finite");
    }
    recorded.is_periodic[k] = true;
    recorded.low[k] = origin;
    recorded.length[k] = length;
  }
  frame.box = recorded;
  return absl::OkStatus();
}

absl::Status Decode(const v1::ParticleFrame& message, RecordedFrame& frame) {
  absl::Status status = CopyPositions(message, frame);
  const std::size_t count = frame.ParticleCount();
  if (status.ok()) status = CheckBytes("ids", message.ids().size(), 8 * count);
  if (status.ok()) status = CheckBytes("volumes", message.volumes().size(), 4 * count);
  if (status.ok()) {
    status = CheckBytes("velocities", message.velocities().size(),
                        sizeof(float) * static_cast<std::size_t>(frame.components) * count);
  }
  if (!status.ok()) return status;
  if (absl::Status copied = CopyAttributes(message, frame); !copied.ok()) return copied;
  if (absl::Status copied = CopyBox(message, frame); !copied.ok()) return copied;
  frame.time = message.time();
  wire::CopyBytes(message.ids(), frame.ids);
  wire::CopyBytes(message.volumes(), frame.volumes);
  wire::CopyBytes(message.velocities(), frame.velocities);
  const bool finite = std::all_of(frame.velocities.begin(), frame.velocities.end(),
                                  [](float velocity) { return std::isfinite(velocity); });
  if (!finite) frame.velocities.clear();
  for (const float volume : frame.volumes) {
    if (!(volume > 0 && std::isfinite(volume))) {
      return absl::DataLossError("a volume is not positive and finite");
    }
  }
  return absl::OkStatus();
}

// Adds the number of fields of a message of `type` to `fields`, up to the first malformed one.
// Returns false if the message is malformed or has too many fields. A parsed field can take fifty
// times its serialised size.
bool HasFewFields(CodedInputStream& input, const google::protobuf::Descriptor& type,
                  std::size_t& fields) {
  while (const std::uint32_t tag = input.ReadTag()) {
    const auto wire_type = WireFormatLite::GetTagWireType(tag);
    if (++fields > kMaxFields || wire_type == WireFormatLite::WIRETYPE_START_GROUP) return false;
    const auto* field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
    if (field == nullptr || field->message_type() == nullptr ||
        wire_type != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) {
      if (!WireFormatLite::SkipField(&input, tag)) return false;
      continue;
    }
    int length = 0;
    if (!input.ReadVarintSizeAsInt(&length)) return false;
    const auto limit = input.PushLimit(length);
    if (!HasFewFields(input, *field->message_type(), fields)) return false;
    if (input.BytesUntilLimit() != 0) return false;
    input.PopLimit(limit);
  }
  return true;
}

// Removes the next length-delimited message from `block`.
template <typename Message>
absl::Status TakeMessage(std::string_view& block, Message& message) {
  CodedInputStream stream(reinterpret_cast<const std::uint8_t*>(block.data()),
                          static_cast<int>(block.size()));
  std::uint32_t size = 0;
  const bool has_size = stream.ReadVarint32(&size);
  const std::size_t start = static_cast<std::size_t>(stream.CurrentPosition());
  if (!has_size || size > block.size() - start) {
    return absl::DataLossError("a message cannot be read");
  }
  CodedInputStream content(reinterpret_cast<const std::uint8_t*>(block.data()) + start,
                           static_cast<int>(size));
  std::size_t fields = 0;
  const bool has_few_fields = HasFewFields(content, *Message::descriptor(), fields);
  if (fields > kMaxFields) {
    return absl::DataLossError(absl::StrCat("a message has more than ", kMaxFields, " fields"));
  }
  if (!has_few_fields || !message.ParseFromArray(block.data() + start, static_cast<int>(size))) {
    return absl::DataLossError("a message cannot be read");
  }
  block.remove_prefix(start + size);
  return absl::OkStatus();
}

// Reads the number of frames from the tail of the file. It is only a hint, which is checked while
// frames are read.
std::optional<std::size_t> CountAtTail(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(recording::kMarkBytes), std::ios::end);
  std::string bytes(recording::kMarkBytes, '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) return std::nullopt;
  return recording::ParseMark(bytes, recording::kTailTag);
}

}  // namespace

class RecordingReader::Impl {
 public:
  Impl(std::string path, BlockReader blocks, input::FrameRange range, bool in_space)
      : path_(std::move(path)), blocks_(std::move(blocks)), range_(range), in_space_(in_space) {}

  absl::Status ReadHeader() {
    const auto piece = blocks_.Next(block_);
    if (!piece.ok()) return Located(piece.status());
    partiemc::recording::v1::RecordingHeader message;
    if (*piece != BlockReader::Piece::kBlock || !TakeMessage(block_, message).ok() ||
        !block_.empty()) {
      return Located(absl::DataLossError("there is no header"));
    }
    if (message.has_spacing()) {
      if (!(message.spacing() > 0 && std::isfinite(message.spacing()))) {
        return Located(absl::DataLossError("the spacing is not positive and finite"));
      }
      header_.spacing = message.spacing();
    }
    header_.title = message.title();
    return absl::OkStatus();
  }

  absl::StatusOr<bool> Next(RecordedFrame& frame) {
    while (failure_.ok() && !over_) {
      if (next_index_ >= range_.end) return false;
      const auto more = Take();
      if (!more.ok()) {
        failure_ = Located(more.status());
      } else if (*more) {
        const std::size_t index = next_index_++;
        if (!range_.Contains(index)) continue;
        frame.index = index;
        frame.source = absl::StrCat(path_, ": frame ", index);
        const absl::Status decoded = Decode(message_, frame);
        failure_ = decoded.ok() ? CheckSpace(frame) : Located(decoded);
        if (failure_.ok()) return true;
      }
    }
    if (!failure_.ok()) return failure_;
    return false;
  }

  std::optional<std::size_t> FrameCount() const {
    const auto count = CountAtTail(path_);
    return count ? std::optional(range_.CountOf(*count)) : std::nullopt;
  }

  const std::string& path() const { return path_; }
  const RecordingHeader& header() const { return header_; }
  const std::vector<std::string>& notices() const { return notices_; }

 private:
  absl::Status CheckSpace(const RecordedFrame& frame) const {
    if (in_space_ == (frame.components == 3)) return absl::OkStatus();
    return absl::FailedPreconditionError(absl::StrCat(
        path_, ": frame ", frame.index, " has ",
        in_space_ ? "two coordinates; leave --slice, --surface or --in-space out"
                  : "three coordinates; replay it with --slice or --surface, or convert it with "
                    "--in-space"));
  }

  // Reads the next message into `message_`. Returns false at the end of the file. Adds a notice if
  // the file is truncated.
  absl::StatusOr<bool> Take() {
    if (block_.empty()) {
      const auto piece = blocks_.Next(block_);
      if (!piece.ok()) return piece.status();
      if (*piece != BlockReader::Piece::kBlock) {
        over_ = true;
        if (*piece == BlockReader::Piece::kTail) return CheckCount();
        notices_.push_back(absl::StrCat(path_, ": truncated after ", next_index_,
                                        " frames; what was recorded later is lost"));
        return false;
      }
      if (block_.empty()) return absl::DataLossError("a block is empty");
    }
    const absl::Status status = TakeMessage(block_, message_);
    if (!status.ok()) return status;
    if (message_.sequence() != next_index_) {
      return absl::DataLossError(absl::StrCat("frame ", message_.sequence(), " stands there"));
    }
    return true;
  }

  absl::StatusOr<bool> CheckCount() const {
    if (blocks_.frame_count() == next_index_) return false;
    return absl::DataLossError(absl::StrCat("its end promises ", blocks_.frame_count(), " frames"));
  }

  absl::Status Located(const absl::Status& status) const {
    const bool is_damage = !absl::IsResourceExhausted(status);
    return absl::Status(
        status.code(), absl::StrCat(path_, is_damage ? ": damaged after " : ": after ", next_index_,
                                    " frames: ", status.message(),
                                    is_damage ? "; the frames before are whole" : ""));
  }

  const std::string path_;
  BlockReader blocks_;
  const input::FrameRange range_;
  const bool in_space_;
  RecordingHeader header_;
  std::string_view block_;  // Unread part of the current block.
  v1::ParticleFrame message_;
  std::size_t next_index_ = 0;
  bool over_ = false;
  absl::Status failure_;
  std::vector<std::string> notices_;
};

bool IsRecording(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string expected = recording::MakeMark(recording::kFileTag, 0);
  constexpr std::size_t kTagged = recording::kMarkBytes - sizeof(std::uint64_t);
  std::string bytes(kTagged, '\0');
  return file.read(bytes.data(), kTagged) && bytes == expected.substr(0, kTagged);
}

absl::StatusOr<std::unique_ptr<RecordingReader>> RecordingReader::Open(const std::string& path,
                                                                       const std::string& frames,
                                                                       bool in_space,
                                                                       double max_expansion) {
  absl::StatusOr<input::FrameRange> range = input::FrameRange{};
  if (!frames.empty()) range = input::ParseFrameRange(frames);
  if (!range.ok()) return range.status();
  auto blocks = BlockReader::Open(path, max_expansion);
  if (!blocks.ok()) {
    return absl::Status(blocks.status().code(),
                        absl::StrCat(path, ": ", blocks.status().message()));
  }
  auto impl = std::make_unique<Impl>(path, *std::move(blocks), *range, in_space);
  const absl::Status header = impl->ReadHeader();
  if (!header.ok()) return header;
  return std::unique_ptr<RecordingReader>(new RecordingReader(std::move(impl)));
}

RecordingReader::RecordingReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RecordingReader::~RecordingReader() = default;

const RecordingHeader& RecordingReader::header() const { return impl_->header(); }
absl::StatusOr<bool> RecordingReader::Next(RecordedFrame& frame) { return impl_->Next(frame); }
std::optional<std::size_t> RecordingReader::FrameCount() { return impl_->FrameCount(); }
std::string RecordingReader::Description() const {
  const std::string& title = impl_->header().title;
  return title.empty() ? "recording" : absl::StrCat("recording: ", title);
}
const std::vector<std::string>& RecordingReader::notices() const { return impl_->notices(); }
std::vector<std::string> RecordingReader::files() const { return {impl_->path()}; }

}  // namespace partiemc::client
