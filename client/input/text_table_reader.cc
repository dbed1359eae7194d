// One frame per file: CSV and its relatives.
#include <utility>

#include "client/input/frame_reader.h"
#include "client/input/text.h"
#include "client/input/text_table.h"

namespace partiemc::client::input {
namespace {

class TextTableReader final : public FrameReader {
 public:
  TextTableReader(std::unique_ptr<InputStream> stream, TextTable table, ColumnPlan plan,
                  const ColumnRequest& request)
      : stream_(std::move(stream)),
        table_(std::move(table)),
        plan_(std::move(plan)),
        request_(request) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    if (std::exchange(done_, true)) return false;
    if (rows == nullptr) return true;
    rows->Begin(plan_);
    rows->source = stream_->path();
    while (true) {
      const auto found = table_.ReadRow(cells_);
      if (!found.ok() || !*found) return found.ok() ? absl::StatusOr<bool>(true) : found;
      if (absl::Status status = AppendTextRow(cells_, plan_, request_, *rows); !status.ok()) {
        return stream_->ErrorAtLine(status.code(), std::string(status.message()));
      }
    }
  }

 private:
  std::unique_ptr<InputStream> stream_;
  TextTable table_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
  std::vector<std::string_view> cells_;
  bool done_ = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenTextTable(const std::string& path,
                                                           const ColumnRequest& request) {
  auto stream = InputStream::Open(path);
  if (!stream.ok()) return stream.status();
  auto table = TextTable::Open(**stream);
  if (!table.ok()) return table.status();
  auto plan = table->names().empty() ? PlanUnnamedColumns(table->column_count(), request)
                                     : PlanNamedColumns(table->names(), request);
  if (!plan.ok()) {
    return WithPrefix(path, plan.status());
  }
  return std::make_unique<TextTableReader>(*std::move(stream), *std::move(table), *std::move(plan),
                                           request);
}

}  // namespace partiemc::client::input
