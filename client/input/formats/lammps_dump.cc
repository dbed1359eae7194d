// LAMMPS text dumps ("dump atom" and "dump custom"): frames of sections that begin with "ITEM:".
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

using Vector3 = std::array<double, 3>;

// The simulation box: a point is origin + sum over axes of (fraction * edge).
struct Box {
  Vector3 origin = {0, 0, 0};
  std::array<Vector3, 3> edges = {};
  std::array<bool, 3> is_periodic = {};

  bool IsTilted() const {
    return edges[0][1] != 0 || edges[0][2] != 0 || edges[1][0] != 0 || edges[1][2] != 0 ||
           edges[2][0] != 0 || edges[2][1] != 0;
  }
};

RecordedBox AsRecorded(const Box& box) {
  RecordedBox recorded{.is_periodic = box.is_periodic, .is_tilted = box.IsTilted()};
  for (std::size_t k = 0; k < 3; ++k) {
    recorded.low[k] = box.origin[k];
    recorded.length[k] = box.edges[k][k];
  }
  return recorded;
}

// Makes a box from its lower and upper bounds and, for a triclinic box, the tilts xy, xz and yz.
// For a triclinic box, LAMMPS writes the bounds of its bounding box, which is wider.
Box BoxOfBounds(const std::array<std::vector<double>, 3>& lines) {
  Vector3 low = {lines[0][0], lines[1][0], lines[2][0]};
  Vector3 high = {lines[0][1], lines[1][1], lines[2][1]};
  double xy = 0;
  double xz = 0;
  double yz = 0;
  if (lines[0].size() == 3) {
    xy = lines[0][2];
    xz = lines[1][2];
    yz = lines[2][2];
    low[0] -= std::min({0.0, xy, xz, xy + xz});
    high[0] -= std::max({0.0, xy, xz, xy + xz});
    low[1] -= std::min(0.0, yz);
    high[1] -= std::max(0.0, yz);
  }
  Box box;
  box.origin = low;
  box.edges = {Vector3{high[0] - low[0], 0, 0}, Vector3{xy, high[1] - low[1], 0},
               Vector3{xz, yz, high[2] - low[2]}};
  return box;
}

// "ITEM: BOX BOUNDS abc origin": each line has an edge and a coordinate of the origin.
Box BoxOfEdges(const std::array<std::vector<double>, 3>& lines) {
  Box box;
  for (std::size_t k = 0; k < 3; ++k) {
    box.edges[k] = {lines[k][0], lines[k][1], lines[k][2]};
    box.origin[k] = lines[k][3];
  }
  return box;
}

class LammpsDumpReader final : public FrameReader {
 public:
  LammpsDumpReader(std::unique_ptr<InputStream> stream, const ColumnRequest& request)
      : stream_(std::move(stream)), request_(request) {
    request_.is_lammps_dump = true;
  }

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    head_ = FrameHead();
    std::string_view line;
    while (true) {
      const auto found = ReadContentLine(line);
      if (!found.ok()) return found;
      if (!*found) break;
      if (!line.starts_with("ITEM:")) {
        return Error("expected a line that begins with ITEM:; the file is damaged");
      }
      const std::string_view item = line.substr(std::min<std::size_t>(6, line.size()));
      if (item.starts_with("ATOMS")) return ReadAtoms(std::string(item.substr(5)), rows);
      if (absl::Status status = ReadItem(item); !status.ok()) return status;
    }
    if (!head_.begun) {
      if (frame_ > 0) return false;
      return absl::DataLossError(Concat(stream_->path(), ": holds no frame"));
    }
    return Error("the file ends within the head of the frame; it is truncated");
  }

 private:
  struct FrameHead {
    bool begun = false;
    std::optional<double> time;
    std::string step;
    std::optional<std::uint64_t> atoms;
    std::optional<Box> box;
  };

  // "FILE:LINE: frame 3 (timestep 500): message".
  absl::Status Error(std::string_view message,
                     absl::StatusCode code = absl::StatusCode::kDataLoss) const {
    return stream_->ErrorAtLine(code, Concat(FrameName(), ": ", message));
  }

  std::string FrameName() const {
    return Concat("frame ", frame_,
                  head_.step.empty() ? "" : Concat(" (timestep ", head_.step, ")"));
  }

  absl::StatusOr<bool> ReadContentLine(std::string_view& line) {
    while (true) {
      const auto found = stream_->ReadLine(line);
      if (!found.ok() || !*found) return found;
      if (line.find_first_not_of(" \t") != std::string_view::npos) return true;
    }
  }

  // Reads the line after an ITEM line and sets `value` to its first cell.
  absl::Status ReadValue(std::string_view name, std::string& value) {
    std::string_view line;
    const auto found = ReadContentLine(line);
    if (!found.ok()) return found.status();
    if (*found) SplitAtBlanks(line, cells_);
    if (!*found || cells_.empty()) return Error(Concat("the file ends within ", name));
    value = std::string(cells_.front());
    return absl::OkStatus();
  }

  absl::Status ReadItem(std::string_view item) {
    head_.begun = true;
    std::string value;
    if (item.starts_with("BOX BOUNDS")) {
      // The item is a view of a line that ReadBox replaces.
      const std::string flags(item.substr(std::string_view("BOX BOUNDS").size()));
      return ReadBox(flags, Contains(flags, "abc"));
    }
    if (item.starts_with("UNITS")) return ReadValue("UNITS", value);
    if (item.starts_with("TIMESTEP")) return ReadValue("TIMESTEP", head_.step);
    if (item.starts_with("TIME")) {
      if (absl::Status status = ReadValue("TIME", value); !status.ok()) return status;
      head_.time = ParseNumber(value);
      return head_.time ? absl::OkStatus()
                        : Error(Concat("the time '", value, "' is not a number"));
    }
    if (item.starts_with("NUMBER OF ATOMS")) {
      if (absl::Status status = ReadValue("NUMBER OF ATOMS", value); !status.ok()) return status;
      head_.atoms = ParseCount(value);
      if (head_.atoms && *head_.atoms <= kMaxParticles) return absl::OkStatus();
      return Error(Concat("the number of atoms is '", value, "'; must be 0 to ", kMaxParticles));
    }
    return Error("unknown ITEM; only text dumps of the styles atom and custom are read");
  }

  // `flags`: the rest of the line: "pp pp ff", "xy xz yz pp pp pp", or nothing.
  absl::Status ReadBox(const std::string& flags, bool as_edges) {
    std::array<std::vector<double>, 3> lines;
    for (std::vector<double>& numbers : lines) {
      std::string_view line;
      const auto found = stream_->ReadLine(line);
      if (!found.ok()) return found.status();
      if (!*found) return Error("the file ends within BOX BOUNDS; it is truncated");
      SplitAtBlanks(line, cells_);
      for (const std::string_view cell : cells_) {
        const auto number = ParseNumber(cell);
        if (!number) return Error("a line of BOX BOUNDS must hold numbers only");
        numbers.push_back(*number);
      }
      const bool fits = as_edges ? numbers.size() == 4 : numbers.size() == 2 || numbers.size() == 3;
      if (!fits || numbers.size() != lines[0].size()) {
        return Error("a line of BOX BOUNDS must hold 2 numbers, or 3 for a triclinic box");
      }
    }
    head_.box = as_edges ? BoxOfEdges(lines) : BoxOfBounds(lines);
    SplitAtBlanks(flags, cells_);
    for (std::size_t k = 0, axis = 0; k < cells_.size() && axis < 3; ++k) {
      // Other words name tilts. A boundary has two letters of p, f, s, m.
      if (cells_[k].size() != 2 || cells_[k].find_first_not_of("pfsm") != std::string_view::npos) {
        continue;
      }
      head_.box->is_periodic[axis++] = cells_[k] == "pp";
    }
    return absl::OkStatus();
  }

  // Makes a new plan only if the columns have changed.
  absl::Status PlanColumns(const std::string& columns) {
    if (plan_ && columns == planned_columns_) return absl::OkStatus();
    std::vector<std::string_view> names;
    SplitAtBlanks(columns, names);
    if (names.empty()) {
      return Error("ITEM: ATOMS names no columns; write the dump with a LAMMPS of this century",
                   absl::StatusCode::kFailedPrecondition);
    }
    auto plan = PlanNamedColumns({names.begin(), names.end()}, request_);
    if (!plan.ok()) return Error(std::string(plan.status().message()), plan.status().code());
    plan_ = *std::move(plan);
    planned_columns_ = columns;
    return absl::OkStatus();
  }

  absl::Status EndsAfter(std::uint64_t atoms) const {
    return Error(
        Concat("ends after ", atoms, " of ", *head_.atoms, " atoms; the file is truncated"));
  }

  absl::StatusOr<bool> ReadAtoms(const std::string& columns, ParticleRows* rows) {
    if (!head_.atoms) return Error("ITEM: ATOMS comes before the number of atoms");
    // Checks for the end of the file before it plans the columns, because a truncated file may lack
    // some of their names.
    const auto next = stream_->Peek(1);
    if (!next.ok()) return next.status();
    if (next->empty() && *head_.atoms > 0) return EndsAfter(0);
    if (rows != nullptr) {
      if (absl::Status status = PlanColumns(columns); !status.ok()) return status;
      rows->Begin(*plan_);
      rows->time = head_.time;
      rows->step = ParseNumber(head_.step);
      if (head_.box) rows->box = AsRecorded(*head_.box);
      rows->source = Concat(stream_->path(), ", ", FrameName());
    }
    std::string_view line;
    for (std::uint64_t atom = 0; atom < *head_.atoms; ++atom) {
      const auto found = stream_->ReadLine(line);
      if (!found.ok()) return found;
      if (!*found || line.starts_with("ITEM:")) return EndsAfter(atom);
      if (rows == nullptr) continue;
      SplitAtBlanks(line, cells_);
      const std::size_t count = rows->count;
      absl::Status status = AppendTextRow(cells_, *plan_, request_, *rows);
      if (status.ok() && rows->count > count) status = UnwrapLast(*rows);
      if (!status.ok()) return Error(std::string(status.message()), status.code());
    }
    if (rows != nullptr && plan_->scaled) {
      if (absl::Status status = Unscale(*rows); !status.ok()) return status;
    }
    ++frame_;
    return true;
  }

  // Unwraps the position of the last row by its image flags, which count crossed boxes.
  absl::Status UnwrapLast(ParticleRows& rows) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!plan_->images[axis]) continue;
      const std::string_view cell = cells_[*plan_->images[axis]];
      const auto image = ParseNumber(cell);
      if (!image || !std::isfinite(*image) || std::trunc(*image) != *image) {
        return absl::DataLossError(
            Concat("the image flag '", cell, "' must be a whole number; the file is damaged"));
      }
      if (*image == 0) continue;
      if (plan_->scaled) {
        if (rows.has_position[axis]) rows.positions[axis].back() += *image;
        continue;
      }
      if (!head_.box) {
        return absl::DataLossError("image flags (ix iy) without BOX BOUNDS");
      }
      for (std::size_t k = 0; k < 3; ++k) {
        if (rows.has_position[k]) rows.positions[k].back() += *image * head_.box->edges[axis][k];
      }
    }
    return absl::OkStatus();
  }

  // Converts fractions of the box to coordinates. An axis that the dump lacks counts as 0.
  absl::Status Unscale(ParticleRows& rows) const {
    if (!head_.box) return Error("scaled positions (xs ys) without BOX BOUNDS");
    const Box& box = *head_.box;
    for (std::size_t i = 0; i < rows.count; ++i) {
      Vector3 point = box.origin;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!rows.has_position[axis]) continue;
        const double fraction = rows.positions[axis][i];
        for (std::size_t k = 0; k < 3; ++k) {
          // A zero edge component must not turn an infinite fraction into NaN in another axis.
          if (box.edges[axis][k] != 0) point[k] += fraction * box.edges[axis][k];
        }
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (rows.has_position[axis]) rows.positions[axis][i] = point[axis];
      }
    }
    return absl::OkStatus();
  }

  std::unique_ptr<InputStream> stream_;
  ColumnRequest request_;
  std::size_t frame_ = 0;
  FrameHead head_;
  std::optional<ColumnPlan> plan_;
  std::string planned_columns_;
  std::vector<std::string_view> cells_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenLammpsDump(const std::string& path,
                                                            const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  return std::make_unique<LammpsDumpReader>(*std::move(stream), request);
}

}  // namespace partiemc::client::input
