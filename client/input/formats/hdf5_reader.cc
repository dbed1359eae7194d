// Reads the frames of HDF5 files: the arrays that hdf5_frames.h finds.
#include <algorithm>
#include <utility>

#include "client/input/base/array_table.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/hdf5_file.h"
#include "client/input/formats/hdf5_frames.h"
#include "client/input/formats/pysph.h"

namespace partiemc::client::input {
namespace {

class Hdf5Reader final : public FrameReader {
 public:
  Hdf5Reader(std::shared_ptr<const Hdf5File> file, Hdf5Content content)
      : file_(std::move(file)), content_(std::move(content)) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    if (frame_ == content_.frames.size()) return false;
    const Hdf5Frame& frame = content_.frames[frame_++];
    if (rows == nullptr) return true;
    const std::string source =
        content_.frames.size() == 1
            ? file_->path()
            : Concat(file_->path(), ", frame ", frame_ - 1, " (", frame.place, ")");
    std::vector<StoredArray> arrays;
    const auto count = ArraysOf(frame, source, arrays);
    if (!count.ok()) return count.status();
    ColumnRequest request = content_.request;
    if (content_.pysph) CompletePysphArrays(*count, arrays, request);
    if (absl::Status status = FillRows(arrays, *count, request, source, *rows); !status.ok()) {
      return status;
    }
    rows->time = frame.time;
    rows->step = frame.step;
    return true;
  }

 private:
  struct Candidate {
    Hdf5Column column;
    Hdf5Array array;
    std::optional<double> constant;  // openPMD's constant component.
    std::optional<Hdf5Column> offset;
  };

  // Sets `arrays` to the arrays with the row count of the positions. Returns this count.
  absl::StatusOr<std::size_t> ArraysOf(const Hdf5Frame& frame, const std::string& source,
                                       std::vector<StoredArray>& arrays) const {
    std::vector<Candidate> candidates;
    for (const Hdf5Column& column : frame.columns) AddDataset(column, candidates);
    if (frame.columns.empty()) {
      absl::Status status = AddGroup(frame.group, "", candidates);
      if (!status.ok()) return status;
    }
    std::vector<StoredArray> all;
    for (const Candidate& candidate : candidates) {
      all.push_back({.name = candidate.column.name, .components = candidate.array.components});
    }
    const auto positions = PositionArray(all, content_.request);
    if (!positions.ok()) return WithPrefix(source, positions.status());
    const std::uint64_t rows = candidates[*positions].array.rows;
    std::erase_if(candidates, [&](const auto& candidate) { return candidate.array.rows != rows; });
    if (absl::Status status = CheckConstants(candidates, rows, source); !status.ok()) {
      return status;
    }
    for (const Candidate& candidate : candidates) arrays.push_back(Stored(candidate, rows));
    return static_cast<std::size_t>(rows);
  }

  // A constant takes no bytes in the file, so another array must confirm the number of rows.
  absl::Status CheckConstants(const std::vector<Candidate>& candidates, std::uint64_t rows,
                              const std::string& source) const {
    if (std::none_of(candidates.begin(), candidates.end(),
                     [](const Candidate& candidate) { return candidate.constant.has_value(); })) {
      return absl::OkStatus();
    }
    absl::Status status =
        absl::DataLossError(Concat(source, ": has no array of ", rows, " particles"));
    for (const Candidate& candidate : candidates) {
      if (candidate.constant) continue;
      status = file_->CheckStored(candidate.column.dataset);
      if (status.ok()) break;
    }
    return status;
  }

  void AddDataset(const Hdf5Column& column, std::vector<Candidate>& candidates) const {
    auto array = file_->Describe(column.dataset);
    if (!array) return;
    if (column.count) array->rows = *column.count;
    candidates.push_back({column, *array, std::nullopt, std::nullopt});
  }

  // Adds the datasets of `group` and of the groups in it to `candidates`. The name of openPMD's
  // dataset position/x becomes position:x.
  absl::Status AddGroup(const std::string& group, const std::string& prefix,
                        std::vector<Candidate>& candidates) const {
    const auto names = file_->Members(group);
    if (!names.ok()) return names.status();
    for (const std::string& name : *names) {
      const std::string path = JoinPath(group, name);
      if (name == "positionOffset") continue;
      const std::size_t before = candidates.size();
      AddDataset({Concat(prefix, name), path}, candidates);
      if (candidates.size() > before) {
        AddOffset(group, name, candidates.back());
        continue;
      }
      const auto value = file_->Attribute(path, "value");
      const auto extent = file_->Attribute(path, "shape");
      if (value && extent) {
        Candidate constant{{Concat(prefix, name), path}, {}, *value, std::nullopt};
        constant.array.rows = IdOfNumber(*extent).value_or(0);
        AddOffset(group, name, constant);
        candidates.push_back(std::move(constant));
      } else if (prefix.empty() && file_->IsGroup(path)) {
        absl::Status status = AddGroup(path, Concat(name, ":"), candidates);
        if (!status.ok()) return status;
      }
    }
    return absl::OkStatus();
  }

  // In openPMD a position is the sum of position and positionOffset, each in a unit that the file
  // states.
  void AddOffset(const std::string& group, const std::string& name, Candidate& candidate) const {
    if (!group.ends_with("/position")) return;
    const std::string path = Concat(ParentOf(group), "/positionOffset/", name);
    if (file_->Describe(path)) candidate.offset = Hdf5Column{name, path};
    const double value = file_->Attribute(path, "value").value_or(0);
    if (value != 0) candidate.offset = Hdf5Column{name, path};
  }

  double UnitOf(const std::string& path) const {
    return file_->Attribute(path, "unitSI").value_or(1);
  }

  StoredArray Stored(const Candidate& candidate, std::uint64_t rows) const {
    const Hdf5Column column = candidate.column;
    const auto load = [file = file_, column, constant = candidate.constant,
                       rows](std::vector<char>& bytes) {
      if (!constant) return file->Read(column.dataset, column.begin, rows, bytes);
      bytes.clear();
      AppendRepeated(*constant, rows, bytes);
      return absl::OkStatus();
    };
    const ElementType type = candidate.constant ? ElementType::kFloat64 : candidate.array.type;
    StoredArray stored{column.name, candidate.array.components, type, false, load};
    if (!candidate.offset) return stored;
    StoredArray sum{column.name, 1, ElementType::kFloat64, false, {}};
    sum.load = [this, stored, path = candidate.offset->dataset, rows,
                unit = UnitOf(candidate.offset->dataset) / UnitOf(column.dataset)](
                   std::vector<char>& bytes) { return LoadSum(stored, path, unit, rows, bytes); };
    return sum;
  }

  static void AppendRepeated(double value, std::uint64_t rows, std::vector<char>& bytes) {
    const char* const raw = reinterpret_cast<const char*>(&value);
    for (std::uint64_t k = 0; k < rows; ++k) bytes.insert(bytes.end(), raw, raw + sizeof(value));
  }

  // Computes position + unit * positionOffset. The offset is a dataset or a constant.
  absl::Status LoadSum(const StoredArray& stored, const std::string& path, double unit,
                       std::uint64_t rows, std::vector<char>& bytes) const {
    std::vector<char> near, far;
    if (absl::Status status = stored.load(near); !status.ok()) return status;
    const auto array = file_->Describe(path);
    if (stored.components != 1 || (array && (array->components != 1 || array->rows != rows))) {
      return absl::DataLossError(
          Concat(file_->path(), ": ", path, " must have one number for each position"));
    }
    if (array) {
      if (absl::Status status = file_->Read(path, 0, rows, far); !status.ok()) return status;
    }
    const double constant = file_->Attribute(path, "value").value_or(0);
    const ArrayColumn a{stored.type, false, near.data(), ElementBytes(stored.type)};
    bytes.clear();
    for (std::size_t k = 0; k < rows; ++k) {
      const double offset =
          array ? ArrayColumn{array->type, false, far.data(), ElementBytes(array->type)}.Number(k)
                : constant;
      AppendRepeated(a.Number(k) + unit * offset, 1, bytes);
    }
    return absl::OkStatus();
  }

  std::shared_ptr<const Hdf5File> file_;
  Hdf5Content content_;
  std::size_t frame_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenHdf5(const std::string& path,
                                                      const ColumnRequest& request) {
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return stream.status();
  if ((*stream)->compressed()) {
    return absl::UnimplementedError(
        Concat(path, ": HDF5 files are not read packed; unpack it first"));
  }
  auto file = Hdf5File::Open(path, request.max_expansion);
  if (!file.ok()) return file.status();
  auto content = FindHdf5Frames(**file, request);
  if (!content.ok()) return content.status();
  return std::make_unique<Hdf5Reader>(*std::move(file), *std::move(content));
}

}  // namespace partiemc::client::input
