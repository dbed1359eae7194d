#include "client/input/sequence.h"

#include <cmath>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_join.h"
#include "client/input/base/text.h"
#include "client/input/collection.h"
#include "client/input/file_list.h"
#include "client/input/formats/formats.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/frame_range.h"
#include "client/input/plane.h"
#include "client/input/times.h"

namespace partiemc::client {
namespace {

using namespace input;

// Largest total size of files that are scanned to count their frames. The scan takes less than a
// second.
constexpr std::size_t kMaxScannedBytes = std::size_t{64} << 20;

// The files of the input and their format.
struct Recording {
  std::vector<std::string> files;
  std::size_t bytes = 0;
  const Format* format = nullptr;  // Format of the first file.
  ColumnRequest request;
  FrameRange range;
  std::optional<FrameTimes> times;
  std::string times_path;
  std::optional<double> time_step;
  std::vector<std::string> notices;
};

class FileSequence final : public Sequence {
 public:
  FileSequence(Recording recording, const SequenceOptions& options)
      : recording_(std::move(recording)),
        projection_(options.in_space, options.needs_sizes || options.needs_diameters) {}

  // Opens the first file, so that its errors are reported at once. Required before Next.
  absl::Status OpenFirstFile() { return OpenNextFile(); }

  absl::StatusOr<bool> Next(RecordedFrame& frame) override {
    if (!failure_.ok()) return failure_;
    auto found = ReadNext(frame);
    if (found.ok() && !*found && selected_ == 0 && unselected_ > 0) found = SelectsNothing();
    failure_ = found.status();
    return found;
  }

  std::optional<std::size_t> FrameCount() override {
    if (!counted_) {
      counted_ = true;
      if (recording_.format->one_frame_per_file) {
        count_ = recording_.files.size();
      } else if (recording_.bytes <= kMaxScannedBytes) {
        count_ = ScanFrames();
      }
      if (count_) count_ = recording_.range.CountOf(*count_);
    }
    return count_;
  }

  std::string Description() const override {
    const auto name = [](const std::string& file) {
      return std::filesystem::path(file).filename().string();
    };
    const std::vector<std::string>& files = recording_.files;
    if (files.size() == 1) {
      return Concat(recording_.format->name, " file ", name(files.front()));
    }
    return Concat(files.size(), " ", recording_.format->name, " files, ", name(files.front()),
                  " to ", name(files.back()));
  }

  const std::vector<std::string>& notices() const override { return recording_.notices; }
  std::vector<std::string> losses() const override { return projection_.losses(); }

  std::vector<std::string> files() const override {
    std::vector<std::string> files = recording_.files;
    if (!recording_.times_path.empty()) files.push_back(recording_.times_path);
    return files;
  }

 private:
  absl::StatusOr<bool> ReadNext(RecordedFrame& frame) {
    while (index_ < recording_.range.end) {
      const bool wanted = recording_.range.Contains(index_);
      if (reader_ == nullptr) {
        if (file_ == recording_.files.size()) return false;
        if (!wanted && recording_.format->one_frame_per_file) {
          ++file_;
          ++index_;
          continue;
        }
        if (absl::Status status = OpenNextFile(); !status.ok()) return status;
      }
      const auto found = reader_->Next(wanted ? &rows_ : nullptr);
      if (!found.ok()) return found;
      if (!*found) {
        reader_.reset();
        continue;
      }
      const std::size_t index = index_++;
      if (!wanted) continue;
      frame.index = index;
      if (absl::Status status = projection_.Project(rows_, frame, recording_.notices);
          !status.ok()) {
        return status;
      }
      selected_ += rows_.count;
      unselected_ += rows_.unselected;
      if (absl::Status status = TakeTime(frame); !status.ok()) return status;
      if (!std::isfinite(frame.time.value_or(0)) || !std::isfinite(frame.step.value_or(0))) {
        return absl::DataLossError(Concat(frame.source, ": its time is not finite; give --times"));
      }
      CheckOrder(frame);
      return true;
    }
    return false;
  }

  absl::Status SelectsNothing() const {
    std::vector<std::string> conditions;
    for (const Condition& condition : recording_.request.conditions) {
      conditions.push_back(Concat("--select ", condition.column, "=", condition.text));
    }
    return absl::FailedPreconditionError(
        Concat(recording_.files.front(), ": none of ", unselected_, " particles fulfils ",
               absl::StrJoin(conditions, " "), "; check the values of the column"));
  }

  absl::Status OpenNextFile() {
    const std::string& path = recording_.files[file_++];
    const auto format = RecogniseFormat(path);
    if (!format.ok()) return format.status();
    // Frames have the indices and times of their files, so each file must hold one frame.
    if (recording_.format->one_frame_per_file && !(*format)->one_frame_per_file) {
      return absl::FailedPreconditionError(Concat(path, ": is a ", (*format)->name,
                                                  " file, which can hold several frames; ",
                                                  recording_.files.front(), " holds one"));
    }
    auto reader = (*format)->open(path, recording_.request);
    if (!reader.ok()) return reader.status();
    reader_ = *std::move(reader);
    return absl::OkStatus();
  }

  // Adds one notice if the time of a frame does not exceed the time of the frame before it.
  void CheckOrder(const RecordedFrame& frame) {
    if (!frame.time) return;
    const std::optional<double> former = std::exchange(former_time_, frame.time);
    if (!former || *frame.time > *former || noticed_order_) return;
    noticed_order_ = true;
    recording_.notices.push_back(
        *frame.time < *former
            ? Concat("time goes back at frame ", frame.index, ": ", *former, " then ", *frame.time,
                     "; check the order of the frames")
            : Concat("time repeats at frame ", frame.index, ": ", *former, "; check the frames"));
  }

  absl::Status TakeTime(RecordedFrame& frame) {
    if (recording_.time_step) {
      if (!frame.step) {
        return absl::FailedPreconditionError(
            Concat(frame.source, ": has no time step for --time-step; give --times"));
      }
      frame.time = *frame.step * *recording_.time_step;
    }
    if (!recording_.times) return absl::OkStatus();
    // A frame without a time in the file is refused: a time of another source, such as the number
    // of the step, can have another unit.
    const auto found = recording_.times->find(frame.index);
    if (found == recording_.times->end()) {
      return absl::FailedPreconditionError(
          Concat(recording_.times_path, ": has no time for frame ", frame.index, " (", frame.source,
                 "); add its time, or choose other frames with --frames"));
    }
    frame.time = found->second;
    return absl::OkStatus();
  }

  // Counts all frames without parsing them. Empty if a file is damaged; Next reports the place.
  std::optional<std::size_t> ScanFrames() const {
    std::size_t count = 0;
    for (const std::string& path : recording_.files) {
      const auto format = RecogniseFormat(path);
      if (!format.ok()) return std::nullopt;
      const auto reader = (*format)->open(path, recording_.request);
      if (!reader.ok()) return std::nullopt;
      while (true) {
        const auto found = (*reader)->Next(nullptr);
        if (!found.ok()) return std::nullopt;
        if (!*found) break;
        ++count;
      }
    }
    return count;
  }

  Recording recording_;
  std::unique_ptr<FrameReader> reader_;
  std::size_t file_ = 0;   // Index of the next file to open.
  std::size_t index_ = 0;  // Index of the next frame.
  ParticleRows rows_;
  PlaneProjection projection_;
  absl::Status failure_;
  std::uint64_t selected_ = 0;         // Particles that --select kept.
  std::uint64_t unselected_ = 0;       // Particles that --select left out.
  std::optional<double> former_time_;  // Of the frame that was read last.
  bool noticed_order_ = false;
  bool counted_ = false;
  std::optional<std::size_t> count_;
};

// Whether the head of the first file of a series can be read.
absl::Status CanBeOpened(const FileSeries& series, const ColumnRequest& request) {
  const auto format = RecogniseFormat(series.files.front());
  if (!format.ok()) return format.status();
  return (*format)->open(series.files.front(), request).status();
}

// Selects the only series of the input that holds frames. Skips unreadable series of a directory or
// pattern with a notice, and uses a times.csv among them for the times.
absl::StatusOr<FileSeries> ChooseSeries(const std::string& input, InputFiles files,
                                        Recording& recording) {
  if (files.kind == InputKind::kFile) return std::move(files.series.front());
  InputFiles readable{files.kind, files.directory, {}};
  std::vector<std::string> reasons;
  for (FileSeries& series : files.series) {
    if (recording.times_path.empty() && IsTimesFile(series.files.front())) {
      if (recording.time_step) continue;
      recording.times_path = series.files.front();
      continue;
    }
    const absl::Status status = CanBeOpened(series, recording.request);
    if (status.ok()) {
      readable.series.push_back(std::move(series));
      continue;
    }
    if (status.code() == absl::StatusCode::kInvalidArgument) return status;
    reasons.push_back(std::string(status.message()));
  }
  if (readable.series.size() > 1) return SeveralSeries(input, readable);
  if (readable.series.empty()) {
    constexpr std::size_t kShown = 3;
    const std::size_t more = reasons.size() > kShown ? reasons.size() - kShown : 0;
    reasons.resize(reasons.size() - more);
    if (reasons.empty()) reasons.push_back("only times");
    return absl::FailedPreconditionError(
        Concat(input, ": holds no frames that can be read: ", absl::StrJoin(reasons, " | "),
               more > 0 ? Concat(" | and ", more, " more") : ""));
  }
  for (const std::string& reason : reasons) {
    recording.notices.push_back(Concat("skipped: ", reason));
  }
  return std::move(readable.series.front());
}

// Sets files and times if `input` is a collection. Returns false for any other input.
absl::StatusOr<bool> TakeCollection(const std::string& input, Recording& recording) {
  auto collection = ReadCollection(input);
  if (!collection.ok()) return collection.status();
  if (!*collection) return false;
  recording.files = std::move((*collection)->files);
  for (const std::string& file : recording.files) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    recording.bytes += error ? 0 : bytes;
  }
  const auto format = RecogniseFormat(recording.files.front());
  if (!format.ok()) return WithPrefix(input, format.status());
  if (!(*format)->one_frame_per_file) {
    return absl::FailedPreconditionError(
        Concat(input, ": lists ", (*format)->name, " files, which hold several frames; name them"));
  }
  if (recording.times_path.empty() && !recording.time_step) {
    recording.times = std::move((*collection)->times);
    recording.times_path = input;
  }
  return true;
}

absl::Status TakeTimes(const std::string& directory, Recording& recording) {
  if (recording.time_step || recording.times) return absl::OkStatus();
  if (recording.times_path.empty()) {
    const std::string beside = (std::filesystem::path(directory) / "times.csv").string();
    const bool is_frame = recording.files.size() == 1 && recording.files.front() == beside;
    std::error_code error;
    if (!is_frame && std::filesystem::exists(beside, error) && IsTimesFile(beside)) {
      recording.times_path = beside;
    }
    if (recording.times_path.empty()) return absl::OkStatus();
  }
  auto times = ReadTimes(recording.times_path);
  if (!times.ok()) return times.status();
  recording.times = *std::move(times);
  recording.notices.push_back(Concat("times of the frames from ", recording.times_path));
  return absl::OkStatus();
}

}  // namespace

std::string ParticleName(const RecordedFrame& frame, std::size_t particle) {
  std::string name = Concat("particle ", particle, " (counted from 0) at (");
  const auto components = static_cast<std::size_t>(frame.components);
  for (std::size_t k = 0; k < components; ++k) {
    AppendAll(name, k == 0 ? "" : ", ", frame.positions[components * particle + k]);
  }
  return name + ')';
}

std::string VolumeName(const RecordedFrame& frame, std::size_t particle) {
  const std::string name = Concat("volume of ", ParticleName(frame, particle));
  if (frame.volume_column.empty()) return name;
  return Concat(name, ", by column '", frame.volume_column, "'");
}

absl::StatusOr<std::unique_ptr<Sequence>> Sequence::Open(const std::string& input,
                                                         const SequenceOptions& options) {
  Recording recording;
  auto request = ParseColumnRequest(options.select, options.columns);
  if (!request.ok()) return request.status();
  recording.request = *std::move(request);
  recording.request.attributes = options.attributes;
  recording.request.max_expansion = options.max_expansion;
  recording.request.needs_sizes = options.needs_sizes;
  recording.request.in_space = options.in_space;
  recording.request.needs_diameters = options.needs_diameters;
  const auto range = ParseFrameRange(options.frames);
  if (!range.ok()) return range.status();
  recording.range = *range;
  recording.times_path = options.times;
  recording.time_step = options.time_step;
  if (options.time_step && !options.times.empty()) {
    return absl::InvalidArgumentError("--time-step: cannot be combined with --times");
  }
  if (options.time_step && !(std::isfinite(*options.time_step) && *options.time_step > 0)) {
    return absl::InvalidArgumentError(
        Concat("--time-step: '", *options.time_step, "'; must be a positive number"));
  }
  const auto collected = TakeCollection(input, recording);
  if (!collected.ok()) return collected.status();
  std::string directory;
  if (!*collected) {
    auto files = ListInput(input);
    if (!files.ok()) return files.status();
    directory = files->directory;
    auto series = ChooseSeries(input, *std::move(files), recording);
    if (!series.ok()) return series.status();
    if (series->uncertain_order) {
      recording.notices.push_back(Concat(
          "the digits after the point in ", series->pattern, " are sorted as decimal ",
          "fractions, .25 before .5; if they are whole numbers, write them with equal length"));
    }
    recording.files = std::move(series->files);
    recording.bytes = series->bytes;
  }
  const auto format = RecogniseFormat(recording.files.front());
  if (!format.ok()) return format.status();
  recording.format = *format;
  if (absl::Status status = TakeTimes(directory, recording); !status.ok()) return status;
  auto sequence = std::make_unique<FileSequence>(std::move(recording), options);
  if (absl::Status status = sequence->OpenFirstFile(); !status.ok()) return status;
  return sequence;
}

}  // namespace partiemc::client
