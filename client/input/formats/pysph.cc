#include "client/input/formats/pysph.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/strings/str_join.h"
#include "client/input/base/little_endian.h"
#include "client/input/base/pickle.h"
#include "client/input/base/text.h"
#include "client/input/formats/npy.h"

namespace partiemc::client::input {
namespace {

// Kind of a particle: 0 real, 1 of another process, 2 ghost.
constexpr std::string_view kTagColumn = "tag";

const StoredArray* FindArray(const std::vector<StoredArray>& arrays, std::string_view name) {
  const auto found = std::find_if(arrays.begin(), arrays.end(),
                                  [&](const StoredArray& array) { return array.name == name; });
  return found == arrays.end() ? nullptr : &*found;
}

StoredArray Quotient(const std::string& name, std::size_t rows, StoredArray above,
                     StoredArray below) {
  const auto load = [rows, above, below](std::vector<char>& bytes) {
    std::vector<char> above_bytes, below_bytes;
    absl::Status status = above.load(above_bytes);
    if (status.ok()) status = below.load(below_bytes);
    if (!status.ok()) return status;
    bytes.resize(rows * sizeof(double));
    const ArrayColumn a{above.type, above.swapped, above_bytes.data(), ElementBytes(above.type)};
    const ArrayColumn b{below.type, below.swapped, below_bytes.data(), ElementBytes(below.type)};
    for (std::size_t row = 0; row < rows; ++row) {
      const double value = a.Number(row) / b.Number(row);
      std::memcpy(bytes.data() + row * sizeof(double), &value, sizeof(double));
    }
    return status;
  };
  return {name, 1, ElementType::kFloat64, false, load};
}

// Reads an object that numpy.savez has pickled as an array without extents.
absl::StatusOr<std::unique_ptr<Pickle>> LoadObject(const std::string& path,
                                                   const ZipArchive& archive,
                                                   std::string_view name) {
  const auto entry = std::find_if(archive.entries().begin(), archive.entries().end(),
                                  [&](const ZipEntry& one) { return one.name == name; });
  const std::string place = Concat(path, ": ", name);
  const auto source = archive.OpenEntry(*entry);
  if (!source.ok()) return source.status();
  std::vector<char> bytes;
  if (absl::Status status = ReadNpyHeaderText(**source, place, bytes); !status.ok()) return status;
  if (absl::Status status = ReadUpTo(**source, static_cast<std::size_t>(entry->bytes), bytes);
      !status.ok()) {
    return status;
  }
  return Pickle::Parse(std::move(bytes), place);
}

// Returns the dict in a pickled array without extents; null if there is none.
const PickleValue* DictOf(const Pickle& pickle) {
  const PickleValue& array = pickle.root();
  if (array.kind != PickleValue::Kind::kArray || array.content == nullptr ||
      array.content->items.size() != 1) {
    return nullptr;
  }
  const PickleValue* const dict = array.content->items[0];
  return dict->kind == PickleValue::Kind::kDict ? dict : nullptr;
}

class PysphArchiveReader final : public OneFrameReader {
 public:
  PysphArchiveReader(std::string path, std::unique_ptr<Pickle> particles,
                     std::unique_ptr<Pickle> solver, const ColumnRequest& request)
      : path_(std::move(path)),
        particles_(std::move(particles)),
        solver_(std::move(solver)),
        request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    const PickleValue* const particles = DictOf(*particles_);
    if (particles == nullptr) {
      return absl::DataLossError(Concat(path_, ": particles is no dict of arrays"));
    }
    std::vector<std::string> names;
    for (std::size_t k = 0; k + 1 < particles->items.size(); k += 2) {
      names.emplace_back(particles->items[k]->text);
    }
    const auto name = ChoosePysphArray(names, request_, path_);
    if (!name.ok()) return name.status();
    const PickleValue* const array = particles->Find(*name);
    const PickleValue* const arrays = array == nullptr ? nullptr : array->Find("arrays");
    if (arrays == nullptr || arrays->kind != PickleValue::Kind::kDict) {
      return absl::DataLossError(Concat(path_, ": ", *name, " has no arrays"));
    }
    std::vector<StoredArray> stored;
    std::size_t rows_of_x = 0;
    ArrayColumn column;
    const PickleValue* const x = arrays->Find("x");
    if (x == nullptr || !ColumnOf(*x, column, rows_of_x)) {
      return absl::DataLossError(Concat(path_, ": ", *name, " has no array x of numbers"));
    }
    for (std::size_t k = 0; k + 1 < arrays->items.size(); k += 2) {
      std::size_t count = 0;
      if (!ColumnOf(*arrays->items[k + 1], column, count) || count != rows_of_x) continue;
      stored.push_back({std::string(arrays->items[k]->text), 1, column.type, column.swapped,
                        [column, count](std::vector<char>& bytes) {
                          bytes.assign(column.data, column.data + count * column.stride);
                          return absl::OkStatus();
                        }});
    }
    CompletePysphArrays(rows_of_x, stored, request_);
    if (absl::Status status = FillRows(stored, rows_of_x, request_, path_, rows); !status.ok()) {
      return status;
    }
    const PickleValue* const solver = DictOf(*solver_);
    if (solver == nullptr) return absl::OkStatus();
    const auto number = [&](std::string_view key) -> std::optional<double> {
      const PickleValue* const value = solver->Find(key);
      if (value == nullptr || value->kind != PickleValue::Kind::kNumber) return std::nullopt;
      return value->number;
    };
    rows.time = number("t");
    rows.step = number("count");
    return absl::OkStatus();
  }

  std::string path_;
  std::unique_ptr<Pickle> particles_;
  std::unique_ptr<Pickle> solver_;
  ColumnRequest request_;  // Read changes it for the chosen array.
};

}  // namespace

absl::StatusOr<std::string> ChoosePysphArray(const std::vector<std::string>& names,
                                             ColumnRequest& request, const std::string& path) {
  std::string wanted;
  for (std::string& column : request.columns) {
    const std::size_t slash = column.rfind('/');
    if (slash == std::string::npos) continue;
    const std::string array = column.substr(0, slash);
    column = column.substr(slash + 1);
    if (wanted.empty()) wanted = array;
    if (array != wanted) {
      return absl::FailedPreconditionError(Concat(path, ": --columns names the arrays ", wanted,
                                                  " and ", array,
                                                  "; the positions must be in one"));
    }
  }
  if (wanted.empty()) wanted = names.size() == 1 ? names.front() : "fluid";
  if (std::find(names.begin(), names.end(), wanted) != names.end()) return wanted;
  return absl::FailedPreconditionError(Concat(path, ": has no particle array '", wanted,
                                              "'; choose one of ", absl::StrJoin(names, ", "),
                                              " by --columns NAME/x,NAME/y"));
}

void CompletePysphArrays(std::size_t rows, std::vector<StoredArray>& arrays,
                         ColumnRequest& request) {
  const StoredArray* const mass = FindArray(arrays, "m");
  const StoredArray* const density = FindArray(arrays, "rho");
  const bool has_quotient =
      mass != nullptr && mass->components == 1 && density != nullptr && density->components == 1;
  if (has_quotient && FindArray(arrays, "volume") == nullptr) {
    StoredArray volume = Quotient("volume", rows, *mass, *density);
    arrays.insert(arrays.begin(), std::move(volume));
  }
  request.tag_is_id = false;
  if (FindArray(arrays, kTagColumn) == nullptr) return;
  const bool selected =
      std::any_of(request.conditions.begin(), request.conditions.end(),
                  [](const Condition& condition) { return condition.column == kTagColumn; });
  if (!selected) request.conditions.push_back({std::string(kTagColumn), "0", 0.0});
}

bool IsPysphArchive(const ZipArchive& archive) {
  const auto has = [&](std::string_view name) {
    return std::any_of(archive.entries().begin(), archive.entries().end(),
                       [&](const ZipEntry& entry) { return entry.name == name; });
  };
  return has("particles.npy") && has("solver_data.npy") && has("version.npy");
}

absl::StatusOr<std::unique_ptr<FrameReader>> OpenPysphArchive(const std::string& path,
                                                              const ZipArchive& archive,
                                                              const ColumnRequest& request) {
  auto particles = LoadObject(path, archive, "particles.npy");
  if (!particles.ok()) return particles.status();
  auto solver = LoadObject(path, archive, "solver_data.npy");
  if (!solver.ok()) return solver.status();
  return std::make_unique<PysphArchiveReader>(path, *std::move(particles), *std::move(solver),
                                              request);
}

}  // namespace partiemc::client::input
