#include "client/input/formats/hdf5_file.h"

#include <hdf5.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "client/input/base/array_table.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/natural_order.h"
#include "client/input/base/text.h"
#include "common/mutex.h"

namespace partiemc::client::input {
namespace {

// Maximum number of members of a group. A group with more is no recording of particles.
constexpr std::size_t kMaxHdf5Members = std::size_t{1} << 20;

// Maximum number of rows of an array, over all frames. Up to this limit, rows times bytes per row
// does not overflow.
constexpr std::uint64_t kMaxRows = std::uint64_t{1} << 48;

// Maximum size of a floating-point number: a long double. libhdf5 would allocate memory for any
// declared size.
constexpr std::size_t kMaxFloatBytes = 16;

Mutex& LibraryMutex() {
  static Mutex mutex;
  return mutex;
}

class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  hid_t id() const { return id_; }
  bool ok() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// Disables the error messages that libhdf5 prints. Each thread must call this, because the setting
// is per thread.
void Silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

// Whether all links of `path` exist and are hard links, which cannot leave the file.
bool LinksStayInFile(hid_t file, const std::string& path) {
  std::size_t end = 0;
  while (end < path.size()) {
    end = std::min(path.find('/', end + 1), path.size());
    const std::string link = path.substr(0, end);
    H5L_info_t info;
    if (H5Lexists(file, link.c_str(), H5P_DEFAULT) <= 0 ||
        H5Lget_info(file, link.c_str(), &info, H5P_DEFAULT) < 0 || info.type != H5L_TYPE_HARD) {
      return false;
    }
  }
  return true;
}

std::optional<H5O_type_t> KindOf(hid_t file, const std::string& path) {
  if (path.empty()) return H5O_TYPE_GROUP;
  if (!LinksStayInFile(file, path)) return std::nullopt;
  H5O_info_t info;
  if (H5Oget_info_by_name(file, path.c_str(), &info, H5P_DEFAULT) < 0) return std::nullopt;
  return info.type;
}

std::optional<ElementType> TypeOfHdf5(hid_t type) {
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) == H5T_FLOAT) {
    if (size > kMaxFloatBytes) return std::nullopt;
    return size > 4 ? ElementType::kFloat64 : ElementType::kFloat32;
  }
  if (H5Tget_class(type) != H5T_INTEGER) return std::nullopt;
  const bool is_signed = H5Tget_sign(type) == H5T_SGN_2;
  switch (size) {
    case 1:
      return is_signed ? ElementType::kInt8 : ElementType::kUInt8;
    case 2:
      return is_signed ? ElementType::kInt16 : ElementType::kUInt16;
    case 4:
      return is_signed ? ElementType::kInt32 : ElementType::kUInt32;
    case 8:
      return is_signed ? ElementType::kInt64 : ElementType::kUInt64;
    default:
      return std::nullopt;
  }
}

hid_t MemoryType(ElementType type) {
  switch (type) {
    case ElementType::kFloat32:
      return H5T_NATIVE_FLOAT;
    case ElementType::kInt8:
      return H5T_NATIVE_INT8;
    case ElementType::kInt16:
      return H5T_NATIVE_INT16;
    case ElementType::kInt32:
      return H5T_NATIVE_INT32;
    case ElementType::kInt64:
      return H5T_NATIVE_INT64;
    case ElementType::kUInt8:
      return H5T_NATIVE_UINT8;
    case ElementType::kUInt16:
      return H5T_NATIVE_UINT16;
    case ElementType::kUInt32:
      return H5T_NATIVE_UINT32;
    case ElementType::kUInt64:
      return H5T_NATIVE_UINT64;
    case ElementType::kFloat64:
      break;
  }
  return H5T_NATIVE_DOUBLE;
}

std::optional<Hdf5Array> DescribeOpen(hid_t dataset) {
  const Handle type(H5Dget_type(dataset), H5Tclose);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  if (!type.ok() || !space.ok()) return std::nullopt;
  const auto element = TypeOfHdf5(type.id());
  const int rank = H5Sget_simple_extent_ndims(space.id());
  if (!element || rank < 1 || rank > 2) return std::nullopt;
  hsize_t extents[2] = {0, 1};
  H5Sget_simple_extent_dims(space.id(), extents, nullptr);
  if (extents[1] < 1 || extents[1] > kMaxArrayComponents) return std::nullopt;
  if (extents[0] > kMaxRows) return std::nullopt;
  return Hdf5Array{*element, extents[0], static_cast<std::size_t>(extents[1])};
}

// Refuses filters that allocate what their parameters declare, and stacked compression, whose
// ratios multiply. Deflate unpacks one byte to at most 1,032.
absl::Status CheckFilters(hid_t creation, const std::string& place) {
  int compressions = 0;
  for (int k = 0; k < H5Pget_nfilters(creation); ++k) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    char name[32] = {};
    const H5Z_filter_t filter = H5Pget_filter2(creation, static_cast<unsigned>(k), &flags, &values,
                                               nullptr, sizeof(name), name, &config);
    compressions += filter == H5Z_FILTER_DEFLATE ? 1 : 0;
    const bool known = filter == H5Z_FILTER_DEFLATE || filter == H5Z_FILTER_SHUFFLE ||
                       filter == H5Z_FILTER_FLETCHER32;
    if (known && compressions < 2) continue;
    return absl::UnimplementedError(Concat(place, ": is packed by the filter ", filter,
                                           known ? " twice" : "",
                                           ", which is not read; write it with gzip once"));
  }
  return absl::OkStatus();
}

// As Hdf5File::CheckStored.
absl::Status CheckStoredNumbers(hid_t dataset, const Hdf5Array& array, const std::string& path,
                                const std::string& place, double max_expansion) {
  const Handle creation(H5Dget_create_plist(dataset), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(creation.id());
  if (layout == H5D_VIRTUAL || H5Pget_external_count(creation.id()) != 0) {
    return absl::UnimplementedError(
        Concat(place, ": its numbers are in another file, which is not read"));
  }
  if (absl::Status status = CheckFilters(creation.id(), place); !status.ok()) return status;
  std::error_code no_size;
  std::uint64_t stored = std::filesystem::file_size(path, no_size);
  const std::uint64_t bytes = array.rows * array.components * ElementBytes(array.type);
  // H5Dget_storage_size walks through the index of chunks, so the size of the file is checked
  // first. For contiguous numbers it returns what the header claims, so the size of the file limits
  // it.
  if (!ExpandsTooMuch(bytes, stored, max_expansion)) {
    stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset), stored);
  }
  if (array.rows > 0 && (stored == 0 || ExpandsTooMuch(bytes, stored, max_expansion))) {
    return absl::DataLossError(Concat(place, ": declares ", array.rows,
                                      " rows, but the file holds ", stored,
                                      " bytes; the file is truncated or damaged"));
  }
  hsize_t extents[2] = {1, 1};
  if (layout != H5D_CHUNKED || H5Pget_chunk(creation.id(), 2, extents) < 1) {
    return absl::OkStatus();
  }
  // A chunk is unpacked as a whole. HDF5 limits it to 4 GiB, so the product does not overflow.
  const std::uint64_t chunk_bytes = extents[0] * extents[1] * ElementBytes(array.type);
  if (!ExpandsTooMuch(chunk_bytes, stored, max_expansion)) return absl::OkStatus();
  return absl::DataLossError(Concat(place, ": has chunks of ", chunk_bytes,
                                    " bytes, but the file holds ", stored,
                                    "; write smaller chunks"));
}

struct MemberList {
  std::size_t most = 0;
  std::vector<std::string> names;
};

herr_t AddMember(hid_t /*group*/, const char* name, const H5L_info_t* /*info*/, void* members) {
  auto& list = *static_cast<MemberList*>(members);
  if (list.names.size() >= list.most) return 1;
  list.names.emplace_back(name);
  return 0;
}

}  // namespace

std::string JoinPath(std::string_view group, std::string_view name) {
  return group.empty() ? std::string(name) : Concat(group, "/", name);
}

std::string ParentOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "" : path.substr(0, slash);
}

absl::StatusOr<std::shared_ptr<const Hdf5File>> Hdf5File::Open(const std::string& path,
                                                               double max_expansion) {
  const auto file = OpenFile(path);
  if (!file.ok()) return file.status();
  const MutexLock lock(LibraryMutex());
  Silence();
  const hid_t id = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (id < 0) {
    return absl::DataLossError(
        Concat(path, ": libhdf5 cannot open it; the file is truncated, damaged or being written"));
  }
  return std::shared_ptr<const Hdf5File>(new Hdf5File(path, id, max_expansion));
}

Hdf5File::~Hdf5File() {
  const MutexLock lock(LibraryMutex());
  H5Fclose(id_);
}

absl::StatusOr<std::vector<std::string>> Hdf5File::Members(const std::string& group) const {
  Hdf5Members members = FirstMembers(group, kMaxHdf5Members + 1);
  if (members.names.size() > kMaxHdf5Members) {
    return absl::DataLossError(Concat(path_, ": the group '", group, "' has more than ",
                                      kMaxHdf5Members, " members; divide the file"));
  }
  return std::move(members.names);
}

Hdf5Members Hdf5File::FirstMembers(const std::string& group, std::size_t most) const {
  const MutexLock lock(LibraryMutex());
  Silence();
  if (KindOf(id_, group) != H5O_TYPE_GROUP) return {};
  const Handle opened(H5Gopen2(id_, group.empty() ? "/" : group.c_str(), H5P_DEFAULT), H5Gclose);
  H5G_info_t info;
  if (!opened.ok() || H5Gget_info(opened.id(), &info) < 0) return {};
  MemberList list{.most = most};
  H5Literate(opened.id(), H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, AddMember, &list);
  std::sort(list.names.begin(), list.names.end(), NaturalLess);
  const std::uint64_t count = std::max<std::uint64_t>(list.names.size(), info.nlinks);
  return {std::move(list.names), count};
}

bool Hdf5File::IsGroup(const std::string& path) const {
  const MutexLock lock(LibraryMutex());
  Silence();
  return KindOf(id_, path) == H5O_TYPE_GROUP;
}

std::optional<Hdf5Array> Hdf5File::Describe(const std::string& dataset) const {
  const MutexLock lock(LibraryMutex());
  Silence();
  if (KindOf(id_, dataset) != H5O_TYPE_DATASET) return std::nullopt;
  const Handle opened(H5Dopen2(id_, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  return opened.ok() ? DescribeOpen(opened.id()) : std::nullopt;
}

absl::Status Hdf5File::CheckStored(const std::string& dataset) const {
  const MutexLock lock(LibraryMutex());
  Silence();
  const Handle opened(H5Dopen2(id_, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const auto array = opened.ok() ? DescribeOpen(opened.id()) : std::nullopt;
  const std::string place = Concat(path_, ": ", dataset);
  if (!array) return absl::DataLossError(Concat(place, ": is no dataset of numbers"));
  return CheckStoredNumbers(opened.id(), *array, path_, place, max_expansion_);
}

absl::Status Hdf5File::Read(const std::string& dataset, std::uint64_t begin, std::uint64_t count,
                            std::vector<char>& bytes) const {
  const auto damaged = [&](std::string_view what) {
    return absl::DataLossError(Concat(path_, ": ", dataset, ": ", what));
  };
  const MutexLock lock(LibraryMutex());
  Silence();
  const Handle opened(H5Dopen2(id_, dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const auto array = opened.ok() ? DescribeOpen(opened.id()) : std::nullopt;
  if (!array || count > array->rows || begin > array->rows - count) {
    return damaged(Concat("has no rows ", begin, " to ", begin + count));
  }
  bytes.clear();
  if (count == 0) return absl::OkStatus();
  if (count > kMaxParticles) {
    return damaged(Concat("declares ", count, " rows; at most ", kMaxParticles));
  }
  if (absl::Status status = CheckStoredNumbers(opened.id(), *array, path_,
                                               Concat(path_, ": ", dataset), max_expansion_);
      !status.ok()) {
    return status;
  }
  bytes.resize(static_cast<std::size_t>(count * array->components * ElementBytes(array->type)));
  const Handle file_space(H5Dget_space(opened.id()), H5Sclose);
  const hsize_t start[2] = {begin, 0};
  const hsize_t extents[2] = {count, array->components};
  const int rank = H5Sget_simple_extent_ndims(file_space.id());
  const Handle memory_space(H5Screate_simple(rank, extents, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(file_space.id(), H5S_SELECT_SET, start, nullptr, extents, nullptr) < 0 ||
      H5Dread(opened.id(), MemoryType(array->type), memory_space.id(), file_space.id(), H5P_DEFAULT,
              bytes.data()) < 0) {
    return damaged("libhdf5 cannot read it; the file is truncated or damaged");
  }
  return absl::OkStatus();
}

std::optional<double> Hdf5File::Attribute(const std::string& object,
                                          const std::string& name) const {
  const MutexLock lock(LibraryMutex());
  Silence();
  if (!KindOf(id_, object)) return std::nullopt;
  const std::string path = object.empty() ? "/" : object;
  if (H5Aexists_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT) <= 0) return std::nullopt;
  const Handle attribute(H5Aopen_by_name(id_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  const Handle space(H5Aget_space(attribute.id()), H5Sclose);
  if (!attribute.ok() || !TypeOfHdf5(type.id())) return std::nullopt;
  const hssize_t count = H5Sget_simple_extent_npoints(space.id());
  if (count < 1 || count > 64) return std::nullopt;
  std::vector<double> numbers(static_cast<std::size_t>(count));
  if (H5Aread(attribute.id(), H5T_NATIVE_DOUBLE, numbers.data()) < 0) return std::nullopt;
  return numbers.front();
}

}  // namespace partiemc::client::input
