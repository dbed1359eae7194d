// XYZ text: a count, a line of comment, then lines of "type x y z"; frame after frame.
#include <utility>

#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/base/text_table.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

class XyzReader final : public FrameReader {
 public:
  XyzReader(std::unique_ptr<InputStream> stream, ColumnPlan plan, const ColumnRequest& request)
      : stream_(std::move(stream)), plan_(std::move(plan)), request_(request) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    std::uint64_t count = 0;
    const auto found = ReadHead(count);
    if (!found.ok() || !*found) return found;
    if (rows != nullptr) {
      rows->Begin(plan_);
      rows->source = Concat(stream_->path(), ", frame ", frame_);
    }
    std::string_view line;
    for (std::uint64_t atom = 0; atom < count; ++atom) {
      const auto row_found = stream_->ReadLine(line);
      if (!row_found.ok()) return row_found;
      if (!*row_found) {
        return Error(
            Concat("ends after ", atom, " of ", count, " particles; the file is truncated"));
      }
      if (rows == nullptr) continue;
      SplitAtBlanks(line, cells_);
      if (absl::Status status = AppendTextRow(cells_, plan_, request_, *rows); !status.ok()) {
        return Error(std::string(status.message()));
      }
    }
    ++frame_;
    return true;
  }

 private:
  absl::Status Error(std::string_view message) const {
    return stream_->ErrorAtLine(absl::StatusCode::kDataLoss,
                                Concat("frame ", frame_, ": ", message));
  }

  // Reads the count and the comment. Returns false at the end of the file.
  absl::StatusOr<bool> ReadHead(std::uint64_t& count) {
    std::string_view line;
    do {
      const auto found = stream_->ReadLine(line);
      if (!found.ok()) return found;
      if (!*found) {
        if (frame_ > 0) return false;
        return absl::DataLossError(Concat(stream_->path(), ": holds no frame"));
      }
      SplitAtBlanks(line, cells_);
    } while (cells_.empty() && frame_ > 0);
    const auto number = cells_.size() == 1 ? ParseCount(cells_[0]) : std::nullopt;
    if (!number || *number > kMaxParticles) {
      return Error(Concat("expected the number of particles, 0 to ", kMaxParticles));
    }
    count = *number;
    const auto comment = stream_->ReadLine(line);
    if (!comment.ok()) return comment;
    if (!*comment) return Error("the file ends after the number of particles; it is truncated");
    if (Contains(line, "Properties=") && !Contains(line, "Properties=species:S:1:pos:R:3 ")) {
      return stream_->ErrorAtLine(absl::StatusCode::kUnimplemented,
                                  "extended XYZ with other columns than species and pos is not "
                                  "read; write it as CSV");
    }
    return true;
  }

  std::unique_ptr<InputStream> stream_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
  std::size_t frame_ = 0;
  std::vector<std::string_view> cells_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenXyz(const std::string& path,
                                                     const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  auto plan = PlanNamedColumns({"type", "x", "y", "z"}, request);
  if (!plan.ok()) {
    return WithPrefix(path, plan.status());
  }
  return std::make_unique<XyzReader>(*std::move(stream), *std::move(plan), request);
}

}  // namespace partiemc::client::input
