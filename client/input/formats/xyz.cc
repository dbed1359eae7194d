// XYZ text: for each frame a count, a line of comment, then lines of "type x y z". In extended
// XYZ the comment holds KEY=VALUE pairs. Properties=species:S:1:pos:R:3 describes the columns,
// Lattice="9 0 0 0 9 0 0 0 9" the edges of the box.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/base/text_table.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxXyzColumns = 4096;

// An edge is parallel to an axis if its other components are at most this share of the longest
// edge. Programs that rotate boxes leave rounding errors of about 1e-16.
constexpr double kTiltTolerance = 1e-9;

class XyzReader final : public FrameReader {
 public:
  XyzReader(std::unique_ptr<InputStream> stream, const ColumnRequest& request)
      : stream_(std::move(stream)), request_(request) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    std::uint64_t count = 0;
    const auto found = ReadHead(count);
    if (!found.ok() || !*found) return found;
    if (rows != nullptr) {
      if (absl::Status status = PlanColumns(); !status.ok()) return status;
      rows->Begin(plan_);
      rows->time = ValueOf(comment_, "Time=");
      rows->step = ValueOf(comment_, "Timestep: ");
      rows->box = BoxOfComment();
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
      if (properties_.empty() && cells_.size() == 3) {
        return Error(
            "the row has 3 values; must have type, x, y and z. Without the count and the comment, "
            "the file is a table of x, y and z, which is read");
      }
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
    comment_ = line;
    return true;
  }

  // Makes a new plan only if the columns have changed.
  absl::Status PlanColumns() {
    const std::string properties(Value(comment_, "Properties="));
    if (planned_ && properties == properties_) return absl::OkStatus();
    std::vector<std::string> names = {"type", "x", "y", "z"};
    if (!properties.empty() && !NamesOf(properties, names)) {
      return stream_->ErrorAtLine(
          absl::StatusCode::kDataLoss,
          Concat("Properties=", properties, " must list NAME:TYPE:COLUMNS of at most ",
                 kMaxXyzColumns, " columns"));
    }
    auto plan = PlanNamedColumns(names, request_);
    if (!plan.ok()) return WithPrefix(stream_->path(), plan.status());
    plan_ = *std::move(plan);
    properties_ = properties;
    planned_ = true;
    return absl::OkStatus();
  }

  // Sets `names` to the columns of "species:S:1:pos:R:3". Returns false if `properties` has another
  // form.
  static bool NamesOf(const std::string& properties, std::vector<std::string>& names) {
    names.clear();
    const std::vector<std::string_view> parts = partiemc::Split(properties, ':');
    if (parts.size() % 3 != 0) return false;
    for (std::size_t k = 0; k < parts.size(); k += 3) {
      const auto count = ParseCount(parts[k + 2]);
      if (!count || *count > kMaxXyzColumns - names.size()) return false;
      // OVITO and other programs name velocities "velo".
      const std::string_view name = parts[k] == "velo" ? "velocity" : parts[k];
      for (std::uint64_t c = 0; c < *count; ++c) {
        names.push_back(*count == 1 ? std::string(name) : Concat(name, ":", c));
      }
    }
    return !names.empty();
  }

  // Returns the value after `key` in the comment. The key begins the comment or follows a blank.
  // The value ends at the next blank or, if it is quoted, at the closing quote.
  static std::string_view Value(std::string_view comment, std::string_view key) {
    for (std::size_t at = comment.find(key); at != std::string_view::npos;
         at = comment.find(key, at + 1)) {
      if (at > 0 && comment[at - 1] != ' ') continue;
      std::string_view value = comment.substr(at + key.size());
      const bool quoted = value.starts_with('"');
      if (quoted) value.remove_prefix(1);
      return value.substr(0, value.find(quoted ? '"' : ' '));
    }
    return {};
  }

  static std::optional<double> ValueOf(std::string_view comment, std::string_view key) {
    return ParseNumber(Value(comment, key));
  }

  // The box by Lattice="..." (nine numbers, edge after edge), Origin="..." (by default 0) and
  // pbc="T T F" (by default all axes). Empty without nine numbers.
  std::optional<RecordedBox> BoxOfComment() {
    const auto edges = NumbersOf<9>("Lattice=");
    if (!edges) return std::nullopt;
    RecordedBox box{.low = NumbersOf<3>("Origin=").value_or(std::array<double, 3>{})};
    const auto longest = std::abs(*std::ranges::max_element(
        *edges, {}, [](double component) { return std::abs(component); }));
    SplitAtBlanks(Value(comment_, "pbc="), cells_);
    for (std::size_t k = 0; k < 9; ++k) {
      const std::size_t axis = k / 3;
      if (k % 3 != axis) {
        box.is_tilted = box.is_tilted || std::abs((*edges)[k]) > kTiltTolerance * longest;
        continue;
      }
      box.length[axis] = (*edges)[k];
      constexpr std::string_view kYes = "Tt1";
      box.is_periodic[axis] = cells_.size() != 3 || kYes.find(cells_[axis].front()) != kYes.npos;
    }
    return box;
  }

  // The `count` finite numbers after `key` in the comment. Empty for anything else.
  template <std::size_t count>
  std::optional<std::array<double, count>> NumbersOf(std::string_view key) {
    SplitAtBlanks(Value(comment_, key), cells_);
    if (cells_.size() != count) return std::nullopt;
    std::array<double, count> numbers;
    for (std::size_t k = 0; k < count; ++k) {
      const auto number = ParseNumber(cells_[k]);
      if (!number || !std::isfinite(*number)) return std::nullopt;
      numbers[k] = *number;
    }
    return numbers;
  }

  std::unique_ptr<InputStream> stream_;
  std::string comment_;  // Comment of the frame.
  bool planned_ = false;
  std::string properties_;  // Properties that plan_ belongs to.
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
  return std::make_unique<XyzReader>(*std::move(stream), request);
}

}  // namespace partiemc::client::input
