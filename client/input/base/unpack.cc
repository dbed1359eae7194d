#include "client/input/base/unpack.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kPackedBlockBytes = std::size_t{128} << 10;

// Largest window of zstd: 128 MiB. Text dumps never need more, and zstd would allocate any size
// that the file declares.
constexpr int kMaxZstdWindowLog = 27;

absl::Status Damaged(const std::string& name, std::string_view packing, std::string_view what) {
  return absl::DataLossError(Concat(name, ": the ", packing, " data is damaged: ", what));
}

absl::Status Truncated(const std::string& name, std::string_view packing) {
  return absl::DataLossError(Concat(name, ": the ", packing, " data is truncated"));
}

// Adds the number of bytes read from `source` to `count`.
class CountedSource final : public ByteSource {
 public:
  CountedSource(std::unique_ptr<ByteSource> source, std::uint64_t& count)
      : source_(std::move(source)), count_(count) {}

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    const auto count = source_->Read(bytes, size);
    count_ += count.value_or(0);
    return count;
  }

 private:
  std::unique_ptr<ByteSource> source_;
  std::uint64_t& count_;
};

// Unpacks gzip or zstd. Fails once the bytes expand too much (ExpandsTooMuch).
class BoundedSource final : public ByteSource {
 public:
  BoundedSource(Packing packing, const std::string& name, std::unique_ptr<ByteSource> packed,
                double max_expansion);

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    const auto count = unpacked_->Read(bytes, size);
    unpacked_bytes_ += count.value_or(0);
    if (!ExpandsTooMuch(unpacked_bytes_, packed_bytes_, max_expansion_)) return count;
    return absl::ResourceExhaustedError(Concat(name_, ": ", ExpansionRule(max_expansion_)));
  }

 private:
  const std::string name_;
  const double max_expansion_;
  std::uint64_t packed_bytes_ = 0, unpacked_bytes_ = 0;
  std::unique_ptr<ByteSource> unpacked_;
};

class InflateSource final : public ByteSource {
 public:
  InflateSource(std::string name, std::unique_ptr<ByteSource> packed, bool gzip)
      : name_(std::move(name)), packed_(std::move(packed)), gzip_(gzip), input_(kPackedBlockBytes) {
    constexpr int kGzipOnly = 16;
    ready_ = inflateInit2(&stream_, gzip_ ? kGzipOnly + MAX_WBITS : -MAX_WBITS) == Z_OK;
  }
  InflateSource(const InflateSource&) = delete;
  InflateSource& operator=(const InflateSource&) = delete;
  ~InflateSource() override {
    if (ready_) inflateEnd(&stream_);
  }

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    if (!ready_) return absl::ResourceExhaustedError("zlib has no memory");
    const std::size_t wanted = std::min(size, std::size_t{1} << 30);
    stream_.next_out = reinterpret_cast<Bytef*>(bytes);
    stream_.avail_out = static_cast<uInt>(wanted);
    while (stream_.avail_out == wanted && !finished_) {
      if (stream_.avail_in == 0 && !flushing_) {
        const auto count = packed_->Read(input_.data(), input_.size());
        if (!count.ok()) return count.status();
        if (*count == 0) {
          if (between_members_) break;
          return Truncated(name_, Packing());
        }
        stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
        stream_.avail_in = static_cast<uInt>(*count);
      }
      if (absl::Status status = Step(); !status.ok()) return status;
      // If the output is full, zlib may hold more bytes. Then the next call to zlib needs no
      // further input.
      flushing_ = stream_.avail_out == 0 && !between_members_ && !finished_;
    }
    return wanted - stream_.avail_out;
  }

 private:
  // Raw deflate data is a part of a file, such as an entry of a zip archive. No bytes may follow
  // its end.
  absl::Status CheckEnd() {
    char surplus = 0;
    const auto count = stream_.avail_in > 0 ? std::size_t{1} : packed_->Read(&surplus, 1);
    if (!count.ok()) return count.status();
    return *count == 0 ? absl::OkStatus() : Damaged(name_, Packing(), "bytes follow its end");
  }

  std::string_view Packing() const { return gzip_ ? "gzip" : "deflate"; }

  absl::Status Step() {
    if (between_members_) {
      // Zero bytes after the last gzip member are padding, as in tar files or on tapes.
      if (members_ > 0 && *stream_.next_in == 0) {
        stream_.avail_in = 0;
        finished_ = true;
        return absl::OkStatus();
      }
      between_members_ = false;
    }
    const int result = inflate(&stream_, Z_NO_FLUSH);
    if (result == Z_STREAM_END) {
      ++members_;
      if (!gzip_) {
        finished_ = true;
        return CheckEnd();
      }
      between_members_ = true;
      inflateReset(&stream_);
      return absl::OkStatus();
    }
    if (result == Z_OK || result == Z_BUF_ERROR) return absl::OkStatus();
    return Damaged(name_, Packing(), stream_.msg != nullptr ? stream_.msg : "unknown reason");
  }

  std::string name_;
  std::unique_ptr<ByteSource> packed_;
  bool gzip_;
  std::vector<char> input_;
  z_stream stream_ = {};
  bool ready_ = false;
  bool finished_ = false;
  bool between_members_ = false;
  bool flushing_ = false;
  std::size_t members_ = 0;
};

class ZstdSource final : public ByteSource {
 public:
  ZstdSource(std::string name, std::unique_ptr<ByteSource> packed)
      : name_(std::move(name)), packed_(std::move(packed)), block_(kPackedBlockBytes) {
    if (stream_) ZSTD_DCtx_setParameter(stream_.get(), ZSTD_d_windowLogMax, kMaxZstdWindowLog);
  }

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    if (!stream_) return absl::ResourceExhaustedError("zstd has no memory");
    ZSTD_outBuffer output = {bytes, size, 0};
    while (output.pos == 0) {
      if (input_.pos == input_.size && !flushing_) {
        const auto count = packed_->Read(block_.data(), block_.size());
        if (!count.ok()) return count.status();
        if (*count == 0) {
          if (between_frames_) return std::size_t{0};
          return Truncated(name_, "zstd");
        }
        input_ = {block_.data(), *count, 0};
      }
      const std::size_t rest = ZSTD_decompressStream(stream_.get(), &output, &input_);
      if (ZSTD_isError(rest) != 0) return Damaged(name_, "zstd", ZSTD_getErrorName(rest));
      between_frames_ = rest == 0;
      // If the output is full, zstd may hold more bytes. Then the next call to zstd needs no
      // further input.
      flushing_ = rest != 0 && output.pos == output.size;
    }
    return output.pos;
  }

 private:
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };

  std::string name_;
  std::unique_ptr<ByteSource> packed_;
  std::unique_ptr<ZSTD_DStream, Free> stream_{ZSTD_createDStream()};
  std::vector<char> block_;
  ZSTD_inBuffer input_ = {nullptr, 0, 0};
  bool between_frames_ = false;
  bool flushing_ = false;
};

BoundedSource::BoundedSource(Packing packing, const std::string& name,
                             std::unique_ptr<ByteSource> packed, double max_expansion)
    : name_(name), max_expansion_(max_expansion) {
  auto counted = std::make_unique<CountedSource>(std::move(packed), packed_bytes_);
  if (packing == Packing::kGzip) {
    unpacked_ = std::make_unique<InflateSource>(name, std::move(counted), true);
  } else {
    unpacked_ = std::make_unique<ZstdSource>(name, std::move(counted));
  }
}

}  // namespace

Packing RecognisePacking(std::string_view first_bytes) {
  if (first_bytes.starts_with("\x1f\x8b")) return Packing::kGzip;
  if (first_bytes.starts_with("\x28\xb5\x2f\xfd")) return Packing::kZstd;
  return Packing::kNone;
}

absl::StatusOr<std::unique_ptr<ByteSource>> Unpack(Packing packing, const std::string& name,
                                                   std::unique_ptr<ByteSource> packed,
                                                   double max_expansion) {
  switch (packing) {
    case Packing::kNone:
      return packed;
    case Packing::kDeflate:
      return std::make_unique<InflateSource>(name, std::move(packed), false);
    case Packing::kGzip:
    case Packing::kZstd:
      return std::make_unique<BoundedSource>(packing, name, std::move(packed), max_expansion);
  }
  return absl::InternalError("no such packing");
}

}  // namespace partiemc::client::input
