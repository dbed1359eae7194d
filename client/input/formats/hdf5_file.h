// Reads HDF5 files with libhdf5. Debian's libhdf5 is not thread-safe, so the functions here share
// one lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

/// The path of a member of a group, "" for the root.
std::string JoinPath(std::string_view group, std::string_view name);
/// The group of a path.
std::string ParentOf(const std::string& path);

/// A dataset of numbers with one or two extents.
struct Hdf5Array {
  ElementType type = ElementType::kFloat64;  ///< As read: in this machine's byte order.
  std::uint64_t rows = 0;
  std::size_t components = 1;
};

/// Some members of a group.
struct Hdf5Members {
  std::vector<std::string> names;  ///< In natural order.
  std::uint64_t count = 0;         ///< Number of all members of the group.
};

/// A file. Paths have the form "group/dataset". Only hard links are followed, and virtual datasets
/// and external data are refused, so no other file is read.
class Hdf5File {
 public:
  /// Errors: kDataLoss if libhdf5 cannot open it.
  static absl::StatusOr<std::shared_ptr<const Hdf5File>> Open(const std::string& path,
                                                              double max_expansion);
  ~Hdf5File();

  const std::string& path() const { return path_; }

  /// Names of the members of a group, "" for the root, in natural order. Empty if there is no such
  /// group. Errors: kDataLoss if it has more than 2^20 members.
  absl::StatusOr<std::vector<std::string>> Members(const std::string& group) const;

  /// Selects the first `most` members of a group ("" for the root) in the order of the file.
  /// Returns them in natural order. Empty if there is no such group.
  Hdf5Members FirstMembers(const std::string& group, std::size_t most) const;

  bool IsGroup(const std::string& path) const;

  /// The description of a dataset. Empty if there is no dataset of numbers.
  std::optional<Hdf5Array> Describe(const std::string& dataset) const;

  /// Checks that the numbers of a dataset are in this file, and that neither the dataset nor a
  /// chunk unpacks to more bytes than `max_expansion` of Open permits. Errors: kDataLoss,
  /// kUnimplemented.
  absl::Status CheckStored(const std::string& dataset) const;

  /// Reads rows [begin, begin + count). Errors: kDataLoss if the file holds fewer; as CheckStored.
  absl::Status Read(const std::string& dataset, std::uint64_t begin, std::uint64_t count,
                    std::vector<char>& bytes) const;

  /// The first number of an attribute of a group or dataset. Empty if there is no such attribute,
  /// or if it has no numbers or more than 64.
  std::optional<double> Attribute(const std::string& object, const std::string& name) const;

 private:
  Hdf5File(std::string path, std::int64_t id, double max_expansion)
      : path_(std::move(path)), id_(id), max_expansion_(max_expansion) {}

  std::string path_;
  std::int64_t id_;
  double max_expansion_;
};

}  // namespace partiemc::client::input
