#include "client/input/formats/hdf5_frames.h"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_join.h"
#include "client/input/base/array_table.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/formats/pysph.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxListed = 12;  // Datasets that a message lists.
// Limit on the bytes of the names in the list of frames.
constexpr std::uint64_t kMaxFrameListBytes = std::uint64_t{256} << 20;
constexpr std::uint64_t kMaxVtkPoints = std::uint64_t{1} << 48;  // Points of all frames.
constexpr std::size_t kMaxVisited = 10000;                       // Objects that Listed visits.
constexpr std::ptrdiff_t kMostLevels = 8;  // Levels of groups that Listed visits.

// Returns the number after the last character that is not a digit: 12 for "Step#12".
std::optional<double> NumberAtEnd(std::string_view name) {
  const std::size_t begin = name.find_last_not_of("0123456789") + 1;
  return ParseNumber(name.substr(begin));
}

class Hdf5Survey {
 public:
  Hdf5Survey(const Hdf5File& file, const ColumnRequest& request)
      : file_(file), content_{.frames = {}, .request = request} {}

  absl::StatusOr<Hdf5Content> Take() {
    absl::Status status = TakeFrames();
    if (!status.ok()) return status;
    if (content_.frames.empty()) {
      return absl::DataLossError(Concat(file_.path(), ": holds no frame"));
    }
    return std::move(content_);
  }

 private:
  absl::Status TakeFrames() {
    if (file_.IsGroup("particles") && file_.IsGroup("solver_data")) return TakePysph();
    if (NamesDatasets()) return TakeNamedGroups();
    if (file_.IsGroup("VTKHDF")) return TakeVtk();
    const auto members = file_.Members("");
    if (!members.ok()) return members.status();
    std::vector<std::string> kinds;
    for (const std::string& name : *members) {
      if (name.starts_with("Step#")) AddGroup(name, NumberAtEnd(name));
      if (name.starts_with("PartType")) kinds.push_back(name);
    }
    if (!content_.frames.empty()) return absl::OkStatus();
    if (kinds.size() == 1) {
      AddGroup(kinds.front(), std::nullopt);
      return absl::OkStatus();
    }
    if (file_.IsGroup("data")) {
      if (absl::Status status = TakeOpenPmd(); !status.ok() || !content_.frames.empty()) {
        return status;
      }
    }
    return AskForNames();
  }

  absl::Status Refuse(std::string_view message) const {
    return absl::FailedPreconditionError(Concat(file_.path(), ": ", message));
  }

  void AddGroup(const std::string& group, std::optional<double> step) {
    content_.frames.push_back(
        {.place = group, .group = group, .time = TimeOf(group), .step = step});
  }

  // The time is an attribute of the group or of a group around it, or in Gadget's header.
  std::optional<double> TimeOf(std::string group) const {
    while (true) {
      for (const char* name : {"TimeValue", "time", "Time"}) {
        if (const auto time = file_.Attribute(group, name)) return time;
      }
      if (group.empty()) return file_.Attribute("Header", "Time");
      group = ParentOf(group);
    }
  }

  absl::Status TakePysph() {
    const auto arrays = file_.Members("particles");
    if (!arrays.ok()) return arrays.status();
    const auto array = ChoosePysphArray(*arrays, content_.request, file_.path());
    if (!array.ok()) return array.status();
    content_.pysph = true;
    const std::string group = Concat("particles/", *array, "/arrays");
    content_.frames.push_back({.place = group,
                               .group = group,
                               .time = file_.Attribute("solver_data", "t"),
                               .step = file_.Attribute("solver_data", "count")});
    return absl::OkStatus();
  }

  bool NamesDatasets() const {
    const auto& columns = content_.request.columns;
    return !columns.empty() && std::all_of(columns.begin(), columns.end(), [](const auto& column) {
      return absl::StrContains(column, "/");
    });
  }

  // Adds the groups that --columns names. In "PartType0/Coordinates" or
  // "data/*/particles/fluid/position" the group is the path before the last slash. Each * stands
  // for every name in its place.
  absl::Status TakeNamedGroups() {
    auto& columns = content_.request.columns;
    while (columns.front().starts_with('/')) columns.front().erase(0, 1);
    const std::string pattern = ParentOf(columns.front());
    for (std::string& column : columns) {
      while (column.starts_with('/')) column.erase(0, 1);
      if (ParentOf(column) != pattern) {
        return Refuse(Concat("--columns names datasets of the groups ", pattern, " and ",
                             ParentOf(column), "; the positions must be in one"));
      }
      column = column.substr(column.rfind('/') + 1);
    }
    std::vector<std::string> groups = {""};
    for (const std::string_view part : Split(pattern, '/')) {
      std::vector<std::string> next;
      std::size_t bytes = 0;
      for (const std::string& group : groups) {
        if (part != "*") next.push_back(JoinPath(group, part));
        if (part != "*") continue;
        // Names are limited, because hard links can repeat a group any number of times.
        const auto names = file_.Members(group);
        if (!names.ok()) return names.status();
        for (const std::string& name : *names) {
          next.push_back(JoinPath(group, name));
          bytes += sizeof(std::string) + next.back().size();
          if (bytes > kMaxFrameListBytes)
            return Refuse("has too many groups; choose fewer by --columns");
        }
      }
      groups = std::move(next);
    }
    const bool several = absl::StrContains(pattern, "*");
    for (const std::string& group : groups) {
      if (!file_.IsGroup(group)) continue;
      AddGroup(group, several ? StepOf(group, pattern) : std::nullopt);
    }
    if (!content_.frames.empty()) return absl::OkStatus();
    return Refuse(Concat("has no group ", pattern, "; the datasets are ", Listed()));
  }

  // Returns the number at the end of the name that stands in place of the first * of `pattern`.
  static std::optional<double> StepOf(const std::string& group, const std::string& pattern) {
    const std::vector<std::string_view> parts = Split(pattern, '/');
    const auto star = std::find(parts.begin(), parts.end(), "*") - parts.begin();
    const std::vector<std::string_view> names = Split(group, '/');
    return static_cast<std::size_t>(star) < names.size()
               ? NumberAtEnd(names[static_cast<std::size_t>(star)])
               : std::nullopt;
  }

  // Adds the groups data/ITERATION/particles/SPECIES. Refuses several species.
  absl::Status TakeOpenPmd() {
    std::string species;
    const auto iterations = file_.Members("data");
    if (!iterations.ok()) return iterations.status();
    for (const std::string& iteration : *iterations) {
      const std::string particles = Concat("data/", iteration, "/particles");
      const auto names = file_.Members(particles);
      if (!names.ok()) return names.status();
      if (names->empty()) continue;
      if (species.empty()) species = names->front();
      if (names->size() > 1) {
        return Refuse(Concat("has the species ", absl::StrJoin(*names, ", "),
                             "; choose one by --columns 'data/*/particles/", species,
                             "/position'"));
      }
      AddGroup(JoinPath(particles, names->front()), ParseNumber(iteration));
    }
    return absl::OkStatus();
  }

  // Takes the frames of a VTKHDF file,
  // https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format. The file holds one frame,
  // or a range of each array for each step.
  absl::Status TakeVtk() {
    std::vector<Hdf5Column> columns = {{"Points", "VTKHDF/Points"}};
    const auto arrays = file_.Members("VTKHDF/PointData");
    if (!arrays.ok()) return arrays.status();
    for (const std::string& name : *arrays) {
      columns.push_back({name, Concat("VTKHDF/PointData/", name)});
    }
    const auto steps = file_.Attribute("VTKHDF/Steps", "NSteps");
    if (!steps) {
      content_.frames.push_back({.place = "VTKHDF", .columns = columns, .time = TimeOf("VTKHDF")});
      return absl::OkStatus();
    }
    std::vector<std::uint64_t> counts, parts, first_parts, points;
    std::vector<double> times;
    const auto count = IdOfNumber(*steps);
    absl::Status status = Whole("VTKHDF/NumberOfPoints", counts);
    if (status.ok()) status = Whole("VTKHDF/Steps/PartOffsets", first_parts);
    if (status.ok()) status = Whole("VTKHDF/Steps/PointOffsets", points);
    if (status.ok() && file_.Describe("VTKHDF/Steps/NumberOfParts")) {
      status = Whole("VTKHDF/Steps/NumberOfParts", parts);
    }
    if (status.ok()) status = Numbers("VTKHDF/Steps/Values", times);
    if (!status.ok()) return status;
    std::vector<std::vector<std::uint64_t>> offsets(columns.size(), points);
    for (std::size_t k = 1; k < columns.size(); ++k) {
      const std::string name = Concat("VTKHDF/Steps/PointDataOffsets/", columns[k].name);
      if (!file_.Describe(name)) continue;
      if (status = Whole(name, offsets[k]); !status.ok()) return status;
    }
    if (parts.empty()) parts.assign(first_parts.size(), 1);
    const auto fits = [&](const auto& values) { return count && values.size() >= *count; };
    if (!fits(first_parts) || !fits(points) || !fits(parts) || !fits(times) ||
        !std::all_of(offsets.begin(), offsets.end(), fits)) {
      return absl::DataLossError(
          Concat(file_.path(), ": the arrays of VTKHDF/Steps have fewer values than steps"));
    }
    // Every frame has its own copy of the columns.
    std::uint64_t frame_bytes = 0;
    for (const Hdf5Column& column : columns) {
      frame_bytes += sizeof(column) + column.name.size() + column.dataset.size();
    }
    if (*count > kMaxFrameListBytes / frame_bytes) {
      return absl::DataLossError(Concat(file_.path(), ": has ", *count, " steps of ",
                                        columns.size(), " arrays; their names take over 256 MiB"));
    }
    // sums[k]: points of the first k parts. The limit keeps sums of counts from overflowing.
    std::vector<std::uint64_t> sums = {0};
    for (const std::uint64_t points_of_part : counts) {
      sums.push_back(sums.back() + points_of_part);
      if (sums.back() <= kMaxVtkPoints) continue;
      return absl::DataLossError(Concat(file_.path(), ": declares too many points"));
    }
    for (std::size_t step = 0; step < *count; ++step) {
      if (first_parts[step] > counts.size() || parts[step] > counts.size() - first_parts[step]) {
        return absl::DataLossError(
            Concat(file_.path(), ": step ", step, " has parts beyond NumberOfPoints"));
      }
      const std::uint64_t rows = sums[first_parts[step] + parts[step]] - sums[first_parts[step]];
      Hdf5Frame frame{.place = Concat("step ", step), .columns = columns, .time = times[step]};
      for (std::size_t k = 0; k < columns.size(); ++k) {
        frame.columns[k].begin = offsets[k][step];
        frame.columns[k].count = rows;
      }
      content_.frames.push_back(std::move(frame));
    }
    return absl::OkStatus();
  }

  absl::Status Numbers(const std::string& dataset, std::vector<double>& values) const {
    const auto array = file_.Describe(dataset);
    if (!array || array->components != 1) {
      return absl::DataLossError(Concat(file_.path(), ": has no numbers ", dataset));
    }
    std::vector<char> bytes;
    if (absl::Status status = file_.Read(dataset, 0, array->rows, bytes); !status.ok()) {
      return status;
    }
    const ArrayColumn column{array->type, false, bytes.data(), ElementBytes(array->type)};
    for (std::size_t k = 0; k < array->rows; ++k) values.push_back(column.Number(k));
    return absl::OkStatus();
  }

  absl::Status Whole(const std::string& dataset, std::vector<std::uint64_t>& values) const {
    std::vector<double> numbers;
    if (absl::Status status = Numbers(dataset, numbers); !status.ok()) return status;
    values.clear();
    for (const double number : numbers) {
      const auto whole = IdOfNumber(number);
      if (!whole || *whole > (std::uint64_t{1} << 48)) {
        return absl::DataLossError(Concat(file_.path(), ": ", dataset, " has the value ", number));
      }
      values.push_back(*whole);
    }
    return absl::OkStatus();
  }

  absl::Status AskForNames() const {
    return Refuse(
        Concat("is HDF5 of no known kind; name the datasets of the positions by --columns "
               "(GROUP/x,GROUP/y or GROUP/positions; * for a group per frame): the "
               "datasets are ",
               Listed()));
  }

  // Lists the first datasets of numbers of the file, for messages. If a group has too many members
  // to visit them all, says how many more it has.
  std::string Listed() const {
    std::vector<std::string> found, queue = {""};
    std::optional<std::string> large;
    Hdf5Members of_large;
    for (std::size_t k = 0; k < queue.size() && found.size() < kMaxListed; ++k) {
      const std::string path = queue[k];
      // The depth is limited, because hard links can form cycles.
      if (std::ranges::count(path, '/') > kMostLevels) continue;
      if (!path.empty() && file_.Describe(path)) {
        found.push_back(path);
        continue;
      }
      Hdf5Members members = file_.FirstMembers(path, kMaxVisited - queue.size());
      for (const std::string& name : members.names) queue.push_back(JoinPath(path, name));
      if (large || members.count < kMaxVisited) continue;
      large = path;
      of_large = std::move(members);
    }
    std::string text = found.empty() ? "none" : absl::StrJoin(found, ", ");
    if (found.size() == kMaxListed) text += ", ...";
    if (!large) return text;
    const auto listed = static_cast<std::uint64_t>(std::ranges::count(found, *large, ParentOf));
    if (found.empty()) text += Concat(" of the first ", of_large.names.size(), " members");
    const std::uint64_t seen = found.empty() ? of_large.names.size() : listed;
    const std::string group = large->empty() ? "the root group" : Concat("the group ", *large);
    return Concat(text, "; ", group, " has ", of_large.count - seen, " more members");
  }

  const Hdf5File& file_;
  Hdf5Content content_;
};

}  // namespace

absl::StatusOr<Hdf5Content> FindHdf5Frames(const Hdf5File& file, const ColumnRequest& request) {
  return Hdf5Survey(file, request).Take();
}

}  // namespace partiemc::client::input
