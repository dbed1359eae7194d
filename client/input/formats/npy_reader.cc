// Reads NPY files: an array with one row per particle, or an array of such frames.
#include <utility>

#include "absl/strings/str_join.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/npy.h"

namespace partiemc::client::input {
namespace {

// Maximum number of columns. More columns indicate a transposed array.
constexpr std::size_t kMaxNpyColumns = 4096;

// Maximum number of frames without particles. They take no bytes, so the size of the file does not
// limit their number.
constexpr std::size_t kMaxEmptyFrames = 65536;

class NpyReader final : public FrameReader {
 public:
  // `frame`: header of one frame; `count`: number of frames, or nothing for an array of one frame.
  NpyReader(std::unique_ptr<InputStream> stream, NpyHeader frame, std::optional<std::size_t> count,
            ColumnPlan plan, const ColumnRequest& request)
      : stream_(std::move(stream)),
        header_(std::move(frame)),
        count_(count),
        plan_(std::move(plan)),
        request_(request) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    if (frame_ == count_.value_or(1)) return false;
    const std::string source =
        count_ ? Concat(stream_->path(), ", frame ", frame_) : stream_->path();
    ++frame_;
    if (rows == nullptr && !count_) return true;
    absl::Status status = CheckParticleCount(header_.shape[0]);
    if (!status.ok()) return WithPrefix(source, status);
    status = frame_ == count_.value_or(1) ? ReadNpyElements(*stream_, header_, source, bytes_)
                                          : ReadNpyBytes(*stream_, FrameBytes(), source, bytes_);
    if (!status.ok()) return status;
    if (rows == nullptr) return true;
    rows->Begin(plan_);
    rows->source = source;
    const ArrayTable table = NpyTable(header_, "", bytes_);
    status = AppendArrayRows(table.columns, table.rows, plan_, request_, *rows);
    if (!status.ok()) return WithPrefix(source, status);
    return true;
  }

 private:
  std::size_t FrameBytes() const { return header_.element_count() * header_.element_bytes; }

  std::unique_ptr<InputStream> stream_;
  NpyHeader header_;
  std::optional<std::size_t> count_;
  std::size_t frame_ = 0;
  std::vector<char> bytes_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
};

// If the first extent counts frames, removes it from `header` and returns it. Returns nothing for
// an array of one frame.
absl::StatusOr<std::optional<std::size_t>> TakeFrameCount(NpyHeader& header,
                                                          const std::string& path) {
  if (!header.holds_frames()) return std::nullopt;
  if (header.column_major) {
    return absl::UnimplementedError(
        Concat(path,
               ": holds frames in Fortran order, which is not read; save "
               "numpy.ascontiguousarray(frames)"));
  }
  const std::size_t count = header.shape.front();
  header.shape.erase(header.shape.begin());
  if (count == 0) return absl::DataLossError(Concat(path, ": holds no frame"));
  if (count > kMaxEmptyFrames && header.element_count() == 0) {
    return absl::DataLossError(
        Concat(path, ": has ", count, " frames without particles; at most ", kMaxEmptyFrames));
  }
  return count;
}

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenNpy(const std::string& path,
                                                     const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  auto header = ReadNpyHeader(**stream, path);
  if (!header.ok()) return header.status();
  const std::vector<std::size_t> shape = header->shape;
  const auto count = TakeFrameCount(*header, path);
  if (!count.ok()) return count.status();
  const bool plain = !header->structured;
  if (header->shape.size() != (plain ? 2 : 1) || (plain && shape.back() > kMaxNpyColumns)) {
    return absl::FailedPreconditionError(
        Concat(path, ": has the shape (", absl::StrJoin(shape, ", "),
               "); save one frame per file with one row per particle, shape (N, 2) or (N, 3), or "
               "frames of the shape (frames, N, 2) or (frames, N, 3)"));
  }
  auto plan = header->structured ? PlanNamedColumns(NpyTable(*header, "", {}).names, request)
                                 : PlanUnnamedColumns(header->shape[1], request);
  if (!plan.ok()) {
    return WithPrefix(path, plan.status());
  }
  return std::make_unique<NpyReader>(*std::move(stream), *std::move(header), *count,
                                     *std::move(plan), request);
}

}  // namespace partiemc::client::input
