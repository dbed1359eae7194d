#include "wire/watched_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <optional>
#include <string>

namespace partiemc::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr std::uint32_t LengthTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
}

constexpr std::uint32_t VarintTag(int field) {
  return WireFormatLite::MakeTag(field, WireFormatLite::WIRETYPE_VARINT);
}

std::size_t LengthFieldBytes(int field, std::size_t bytes) {
  return CodedOutputStream::VarintSize32(LengthTag(field)) +
         CodedOutputStream::VarintSize64(bytes) + bytes;
}

// What `write` writes.
template <typename Write>
std::string Written(Write write) {
  std::string text;
  google::protobuf::io::StringOutputStream stream(&text);
  {
    CodedOutputStream out(&stream);
    write(out);
  }
  return text;
}

// Where ReconstructRequest.frame.positions begins in the bytes of a well-formed request; of several
// the last, as for a parser.
std::optional<std::size_t> OffsetOfPositions(grpc::ByteBuffer& request) {
  grpc::ProtoBufferReader reader(&request);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream input(&reader);
  std::optional<std::size_t> offset;
  std::uint32_t length = 0;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (tag != LengthTag(v1::ReconstructRequest::kFrameFieldNumber)) {
      if (!WireFormatLite::SkipField(&input, tag)) return std::nullopt;
      continue;
    }
    if (!input.ReadVarint32(&length)) return std::nullopt;
    const auto outer = input.PushLimit(static_cast<int>(length));
    while (const std::uint32_t inner = input.ReadTag()) {
      if (inner != LengthTag(v1::ParticleFrame::kPositionsFieldNumber)) {
        if (!WireFormatLite::SkipField(&input, inner)) return std::nullopt;
        continue;
      }
      if (!input.ReadVarint32(&length)) return std::nullopt;
      offset = static_cast<std::size_t>(input.CurrentPosition());
      if (!input.Skip(static_cast<int>(length))) return std::nullopt;
    }
    input.PopLimit(outer);
  }
  return offset;
}

}  // namespace

WatchedBytes::WatchedBytes(const grpc::ByteBuffer& response, const v1::ReconstructedFrame& frame) {
  const auto frame_bytes = static_cast<std::size_t>(frame.GetCachedSize());
  // Serialisers write fields in the order of their numbers, so that the checkpoint is the last.
  const std::size_t checkpoint_bytes =
      frame.checkpoint().empty() ? 0
                                 : LengthFieldBytes(v1::ReconstructedFrame::kCheckpointFieldNumber,
                                                    frame.checkpoint().size());
  Append(response, response.Length() - frame_bytes, frame_bytes - checkpoint_bytes);
}

void WatchedBytes::EchoParticles(grpc::ByteBuffer& request, const v1::ParticleFrame& frame) {
  const auto offset = OffsetOfPositions(request);
  if (!offset) return;  // A frame without particles.
  const std::string head = Written([&](CodedOutputStream& out) {
    out.WriteTag(VarintTag(v1::ReconstructedFrame::kParticleFormatFieldNumber));
    out.WriteVarint32(static_cast<std::uint32_t>(frame.position_format()));
    out.WriteTag(LengthTag(v1::ReconstructedFrame::kParticlesFieldNumber));
    out.WriteVarint64(frame.positions().size());
  });
  slices_.emplace_back(head);
  size_ += head.size();
  Append(request, *offset, frame.positions().size());
}

grpc::ByteBuffer WatchedBytes::ToResponse(std::uint64_t dropped) const {
  const std::string frame_head = Written([&](CodedOutputStream& out) {
    if (dropped != 0) {
      out.WriteTag(VarintTag(v1::WatchedFrame::kDroppedFieldNumber));
      out.WriteVarint64(dropped);
    }
    out.WriteTag(LengthTag(v1::WatchedFrame::kFrameFieldNumber));
    out.WriteVarint64(size_);
  });
  std::vector<grpc::Slice> slices;
  slices.reserve(slices_.size() + 1);
  slices.emplace_back(Written([&](CodedOutputStream& out) {
    out.WriteTag(LengthTag(v1::WatchStreamResponse::kFrameFieldNumber));
    out.WriteVarint64(frame_head.size() + size_);
    out.WriteString(frame_head);
  }));
  slices.insert(slices.end(), slices_.begin(), slices_.end());
  return {slices.data(), slices.size()};
}

void WatchedBytes::Append(const grpc::ByteBuffer& whole, std::size_t offset, std::size_t length) {
  std::vector<grpc::Slice> slices;
  if (!whole.Dump(&slices).ok()) return;
  size_ += length;
  for (const grpc::Slice& slice : slices) {
    if (offset < slice.size() && length > 0) {
      const std::size_t end = std::min(slice.size(), offset + length);
      slices_.push_back(slice.sub(offset, end));
      length -= end - offset;
      offset = end;
    }
    offset -= std::min(offset, slice.size());
  }
}

}  // namespace partiemc::wire
