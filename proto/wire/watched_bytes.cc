#include "wire/watched_bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <span>
#include <string>
#include <utility>

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

// The bytes that `write` writes.
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

// A range of bytes of a message.
struct Span {
  std::size_t offset = 0, length = 0;
};

// Appends the result of Find to `found`. Returns false if the message is malformed.
bool FindIn(CodedInputStream& input, std::span<const int> path, std::vector<Span>& found) {
  std::uint32_t length = 0;
  while (const std::uint32_t tag = input.ReadTag()) {
    if (tag != LengthTag(path.front())) {
      if (!WireFormatLite::SkipField(&input, tag)) return false;
      continue;
    }
    if (!input.ReadVarint32(&length)) return false;
    if (path.size() == 1) {
      found.push_back({static_cast<std::size_t>(input.CurrentPosition()), length});
      if (!input.Skip(static_cast<int>(length))) return false;
      continue;
    }
    const auto outer = input.PushLimit(static_cast<int>(length));
    if (!FindIn(input, path.subspan(1), found)) return false;
    input.PopLimit(outer);
  }
  return true;
}

// The contents of the field with the path `path` in the message in `bytes`, in order. Each number
// of a path is a field of the message in the field before it. Empty if the message is malformed.
std::vector<Span> Find(grpc::ByteBuffer& bytes, std::span<const int> path) {
  std::vector<Span> found;
  grpc::ProtoBufferReader reader(&bytes);
  if (!reader.status().ok()) return found;
  CodedInputStream input(&reader);
  if (!FindIn(input, path, found)) found.clear();
  return found;
}

// Shares the memory of `bytes`.
std::vector<grpc::Slice> SlicesOf(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Dump(&slices).ok()) slices.clear();
  return slices;
}

}  // namespace

WatchedBytes::WatchedBytes(grpc::ByteBuffer& response) {
  constexpr int kPath[] = {v1::ReconstructResponse::kFrameFieldNumber};
  // If there are several frames, the last one counts, as for a parser.
  const std::vector<Span> frames = Find(response, kPath);
  if (!frames.empty()) Append(SlicesOf(response), frames.back().offset, frames.back().length);
}

void WatchedBytes::EchoParticles(grpc::ByteBuffer& request, const v1::ParticleFrame& frame) {
  if (frame.positions().empty()) return;  // A frame without particles.
  using From = v1::ParticleFrame;
  using To = v1::ReconstructedFrame;
  static constexpr int kFields[][2] = {
      {From::kPositionsFieldNumber, To::kParticlesFieldNumber},
      {From::kIdsFieldNumber, To::kParticleIdsFieldNumber},
      {From::kVolumesFieldNumber, To::kParticleVolumesFieldNumber},
      {From::kVelocitiesFieldNumber, To::kParticleVelocitiesFieldNumber},
      {From::kScalarsFieldNumber, To::kParticleScalarsFieldNumber},
      {From::kBoxFieldNumber, To::kParticleBoxFieldNumber},
  };
  const std::vector<grpc::Slice> slices = SlicesOf(request);
  AppendOwn(Written([&](CodedOutputStream& out) {
    out.WriteTag(VarintTag(To::kParticleFormatFieldNumber));
    out.WriteVarint32(static_cast<std::uint32_t>(frame.position_format()));
  }));
  for (const auto& [from, to] : kFields) {
    const int path[] = {v1::ReconstructRequest::kFrameFieldNumber, from};
    for (const Span& array : Find(request, path)) {
      if (array.length == 0) continue;
      AppendOwn(Written([&, field = to](CodedOutputStream& out) {
        out.WriteTag(LengthTag(field));
        out.WriteVarint64(array.length);
      }));
      Append(slices, array.offset, array.length);
    }
  }
}

grpc::ByteBuffer WatchedBytes::ToResponse(std::uint64_t dropped,
                                          std::uint64_t oldest_sequence) const {
  const std::string frame_head = Written([&](CodedOutputStream& out) {
    const auto write = [&](int field, std::uint64_t value) {
      if (value == 0) return;
      out.WriteTag(VarintTag(field));
      out.WriteVarint64(value);
    };
    write(v1::WatchedFrame::kDroppedFieldNumber, dropped);
    write(v1::WatchedFrame::kOldestSequenceFieldNumber, oldest_sequence);
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

std::string WatchedBytes::ToString() const {
  std::string bytes;
  bytes.reserve(size_);
  for (const grpc::Slice& slice : slices_) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

void WatchedBytes::AppendOwn(const std::string& bytes) {
  slices_.emplace_back(bytes);
  size_ += bytes.size();
  memory_ += bytes.size();
}

void WatchedBytes::Append(std::span<const grpc::Slice> whole, std::size_t offset,
                          std::size_t length) {
  size_ += length;
  for (const grpc::Slice& slice : whole) {
    if (length == 0) return;
    if (offset < slice.size()) {
      const std::size_t end = std::min(slice.size(), offset + length);
      slices_.push_back(slice.sub(offset, end));
      if (std::exchange(counted_, slice.begin()) != slice.begin()) memory_ += slice.size();
      length -= end - offset;
      offset = end;
    }
    offset -= std::min(offset, slice.size());
  }
}

}  // namespace partiemc::wire
