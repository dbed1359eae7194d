// One frame per file: CSV and similar tables.
#include <utility>

#include "client/input/base/text.h"
#include "client/input/base/text_table.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

class TextTableReader final : public OneFrameReader {
 public:
  TextTableReader(std::unique_ptr<InputStream> stream, TextTable table, ColumnPlan plan,
                  const ColumnRequest& request)
      : stream_(std::move(stream)),
        table_(std::move(table)),
        plan_(std::move(plan)),
        request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    rows.Begin(plan_);
    rows.source = stream_->path();
    while (true) {
      const auto found = table_.ReadRow(cells_);
      if (!found.ok() || !*found) return found.status();
      if (absl::Status status = AppendTextRow(cells_, plan_, request_, rows); !status.ok()) {
        return stream_->ErrorAtLine(status.code(), std::string(status.message()));
      }
    }
  }

  std::unique_ptr<InputStream> stream_;
  TextTable table_;
  ColumnPlan plan_;
  const ColumnRequest& request_;
  std::vector<std::string_view> cells_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenTextTable(const std::string& path,
                                                           const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  const auto preamble = CountPreambleLines(**stream, request.columns);
  if (!preamble.ok()) return preamble.status();
  std::string_view line;
  for (std::size_t k = 0; k < *preamble; ++k) {
    if (const auto found = (*stream)->ReadLine(line); !found.ok()) return found.status();
  }
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
