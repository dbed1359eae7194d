// One frame per file: an NPY array with a row per particle.
#include <utility>

#include "absl/strings/str_join.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/npy.h"

namespace partiemc::client::input {
namespace {

// A row has a few columns. More columns indicate a transposed array.
constexpr std::size_t kMaxColumns = 4096;

class NpyReader final : public OneFrameReader {
 public:
  NpyReader(std::unique_ptr<InputStream> stream, NpyHeader header, ColumnPlan plan,
            const ColumnRequest& request)
      : stream_(std::move(stream)),
        header_(std::move(header)),
        plan_(std::move(plan)),
        request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    std::vector<char> bytes;
    if (absl::Status status = ReadNpyElements(*stream_, header_, stream_->path(), bytes);
        !status.ok()) {
      return status;
    }
    rows.Begin(plan_);
    rows.source = stream_->path();
    const absl::Status status =
        AppendArrayRows(NpyColumns(header_, bytes), header_.shape[0], plan_, request_, rows);
    return status.ok() ? status : WithPrefix(stream_->path(), status);
  }

  std::unique_ptr<InputStream> stream_;
  NpyHeader header_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenNpy(const std::string& path,
                                                     const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  auto header = ReadNpyHeader(**stream, path);
  if (!header.ok()) return header.status();
  if (header->shape.size() != 2 || header->shape[1] > kMaxColumns) {
    return absl::FailedPreconditionError(
        Concat(path, ": has the shape (", absl::StrJoin(header->shape, ", "),
               "); save one frame per file with one row per particle, shape (N, 2) or (N, 3)"));
  }
  auto plan = PlanUnnamedColumns(header->shape[1], request);
  if (!plan.ok()) {
    return WithPrefix(path, plan.status());
  }
  return std::make_unique<NpyReader>(*std::move(stream), *std::move(header), *std::move(plan),
                                     request);
}

}  // namespace partiemc::client::input
