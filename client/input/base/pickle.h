// Reads pickles of Python containers, numbers, text and NumPy arrays. Names of classes and
// functions are compared with known ones and never called; other objects become kOther.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/base/particle_rows.h"

namespace partiemc::client::input {

struct PickleValue {
  enum class Kind { kOther, kNone, kNumber, kText, kSequence, kDict, kGlobal, kType, kArray };
  Kind kind = Kind::kOther;
  double number = 0;
  std::string_view text;                  ///< Of text, bytes, or a global ("module.name").
  std::vector<const PickleValue*> items;  ///< Of a sequence; of a dict: key, value, key, value, ...
  // Set for a NumPy type (its name, such as "f8") and for a NumPy array:
  std::string_view type;
  bool big_endian = false;
  std::vector<std::uint64_t> shape;
  const PickleValue* content = nullptr;  ///< Of an array: text, or a sequence of objects.

  /// The value of a key of a dict. Null if there is none, or if this is no dict.
  const PickleValue* Find(std::string_view key) const;
};

/// A pickle and its values. The values refer to the bytes.
class Pickle {
 public:
  /// Parses a pickle of the protocols 2 to 4, as NumPy and PySPH write them. `name` is for
  /// messages. kDataLoss if the pickle is damaged; kUnimplemented for operations that NumPy and
  /// PySPH do not use.
  static absl::StatusOr<std::unique_ptr<Pickle>> Parse(std::vector<char> bytes,
                                                       const std::string& name);

  const PickleValue& root() const { return *root_; }

 private:
  friend class PickleMachine;

  std::vector<char> bytes_;
  std::deque<PickleValue> values_;  // A deque, so that pointers to its elements stay valid.
  std::deque<std::string> texts_;
  const PickleValue* root_ = nullptr;
};

/// If `value` is a one-dimensional array of numbers, sets `column` to a view of it and `rows` to
/// its length, and returns true. Returns false for other values.
bool ColumnOf(const PickleValue& value, ArrayColumn& column, std::size_t& rows);

}  // namespace partiemc::client::input
