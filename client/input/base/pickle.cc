#include "client/input/base/pickle.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <optional>

#include "client/input/base/little_endian.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

// Maximum number of values, to limit the memory that a small hostile file can use. Pickles of
// arrays have fewer.
constexpr std::size_t kMaxPickleValues = std::size_t{1} << 20;
constexpr std::size_t kMaxNameBytes = 1 << 16;

using Kind = PickleValue::Kind;

std::optional<ElementType> ElementTypeOf(std::string_view code) {
  struct Known {
    std::string_view code;
    ElementType type;
  };
  constexpr Known kKnown[] = {
      {"f4", ElementType::kFloat32}, {"f8", ElementType::kFloat64}, {"i1", ElementType::kInt8},
      {"i2", ElementType::kInt16},   {"i4", ElementType::kInt32},   {"i8", ElementType::kInt64},
      {"u1", ElementType::kUInt8},   {"u2", ElementType::kUInt16},  {"u4", ElementType::kUInt32},
      {"u8", ElementType::kUInt64},  {"b1", ElementType::kUInt8}};
  for (const Known& known : kKnown) {
    if (code == known.code) return known.type;
  }
  return std::nullopt;
}

}  // namespace

// Executes the operations of a pickle (Python's pickletools.py describes them).
class PickleMachine {
 public:
  PickleMachine(Pickle& pickle, const std::string& name)
      : pickle_(pickle), rest_(pickle.bytes_.data(), pickle.bytes_.size()), name_(name) {}

  absl::Status Run() {
    while (true) {
      if (std::max({pickle_.values_.size(), stack_.size(), memo_.size()}) > kMaxPickleValues) {
        return Damaged("has more than a million values");
      }
      const std::size_t at = pickle_.bytes_.size() - rest_.size();
      const auto operation = Bytes(1);
      if (!operation) return Damaged("ends early; the file is truncated");
      if (operation->front() == '.') {
        if (stack_.size() != 1 || stack_[0] == nullptr) return Damaged("has no single value");
        pickle_.root_ = stack_[0];
        return absl::OkStatus();
      }
      const Outcome outcome = Step(operation->front());
      if (outcome == Outcome::kUnknown) {
        return absl::UnimplementedError(Concat(name_, ": its pickle has the operation ",
                                               static_cast<int>(operation->front()), " at byte ",
                                               at, ", which arrays do not need"));
      }
      if (outcome == Outcome::kBroken) return Damaged(Concat("is broken at byte ", at));
    }
  }

 private:
  enum class Outcome { kGood, kBroken, kUnknown };

  absl::Status Damaged(std::string_view what) const {
    return absl::DataLossError(Concat(name_, ": its pickle ", what));
  }

  // Counts bytes that operations copy from other values. A pickle may refer to one value any number
  // of times, so these bytes are limited to the size of the pickle plus kMaxNameBytes. Returns
  // false above the limit.
  bool MayMake(std::size_t bytes) {
    made_bytes_ += bytes;
    return made_bytes_ <= pickle_.bytes_.size() + kMaxNameBytes;
  }

  std::optional<std::string_view> Bytes(std::uint64_t count) {
    if (count > rest_.size()) return std::nullopt;
    const std::string_view bytes = rest_.substr(0, static_cast<std::size_t>(count));
    rest_.remove_prefix(bytes.size());
    return bytes;
  }

  std::optional<std::string_view> Line() {
    const std::size_t end = rest_.find('\n');
    if (end == std::string_view::npos) return std::nullopt;
    const auto line = Bytes(end);
    Bytes(1);
    return line;
  }

  std::optional<std::uint64_t> Count(std::size_t bytes) {
    const auto text = Bytes(bytes);
    if (!text) return std::nullopt;
    return LittleEndian(*text, 0, bytes);
  }

  Outcome Push(PickleValue value) {
    pickle_.values_.push_back(std::move(value));
    stack_.push_back(&pickle_.values_.back());
    return Outcome::kGood;
  }

  Outcome PushNumber(std::optional<double> number) {
    if (!number) return Outcome::kBroken;
    return Push({.kind = Kind::kNumber, .number = *number});
  }

  Outcome PushText(std::optional<std::string_view> text) {
    if (!text) return Outcome::kBroken;
    return Push({.kind = Kind::kText, .text = *text});
  }

  Outcome PushSized(std::optional<std::uint64_t> size) {
    return size ? PushText(Bytes(*size)) : Outcome::kBroken;
  }

  Outcome PushGlobal(std::optional<std::string_view> module, std::optional<std::string_view> name) {
    if (!module || !name || !MayMake(module->size() + name->size() + 1)) return Outcome::kBroken;
    pickle_.texts_.push_back(Concat(*module, ".", *name));
    return Push({.kind = Kind::kGlobal, .text = pickle_.texts_.back()});
  }

  // Pushes a little-endian number in two's complement of at most 8 bytes. A larger number cannot be
  // a count and becomes kOther.
  Outcome PushLong(std::optional<std::uint64_t> size) {
    if (!size) return Outcome::kBroken;
    const auto bytes = Bytes(*size);
    if (!bytes) return Outcome::kBroken;
    if (*size == 0) return PushNumber(0);
    if (*size > 8) return Push({});
    auto value = LittleEndian(*bytes, 0, bytes->size());
    if (*size < 8 && (static_cast<unsigned char>(bytes->back()) & 0x80) != 0) {
      value |= ~std::uint64_t{0} << (8 * *size);
    }
    return PushNumber(static_cast<double>(static_cast<std::int64_t>(value)));
  }

  // Removes the last mark and the values above it, and returns these values.
  std::optional<std::vector<const PickleValue*>> TakeToMark() {
    const auto mark = std::find(stack_.rbegin(), stack_.rend(), nullptr);
    if (mark == stack_.rend()) return std::nullopt;
    const auto begin = mark.base();
    std::vector<const PickleValue*> values(begin, stack_.end());
    stack_.erase(begin - 1, stack_.end());
    return values;
  }

  PickleValue* Take() {
    if (stack_.empty() || stack_.back() == nullptr) return nullptr;
    PickleValue* const value = stack_.back();
    stack_.pop_back();
    return value;
  }

  Outcome PushSequence(std::size_t count) {
    PickleValue sequence{.kind = Kind::kSequence};
    sequence.items.resize(count);
    for (std::size_t k = count; k-- > 0;) {
      sequence.items[k] = Take();
      if (sequence.items[k] == nullptr) return Outcome::kBroken;
    }
    return Push(std::move(sequence));
  }

  Outcome PushToMark(Kind kind) {
    auto items = TakeToMark();
    if (!items || (kind == Kind::kDict && items->size() % 2 != 0)) return Outcome::kBroken;
    return Push({.kind = kind, .items = *std::move(items)});
  }

  // Adds `items` to the container on top.
  Outcome Extend(std::optional<std::vector<const PickleValue*>> items, Kind kind) {
    if (!items || stack_.empty() || stack_.back() == nullptr) return Outcome::kBroken;
    if (std::find(items->begin(), items->end(), nullptr) != items->end()) return Outcome::kBroken;
    if (kind == Kind::kDict && items->size() % 2 != 0) return Outcome::kBroken;
    PickleValue& container = *stack_.back();
    if (container.kind == kind) {
      container.items.insert(container.items.end(), items->begin(), items->end());
    }
    return Outcome::kGood;
  }

  Outcome Memoize(std::optional<std::uint64_t> key) {
    if (!key || stack_.empty() || stack_.back() == nullptr) return Outcome::kBroken;
    memo_[*key] = stack_.back();
    return Outcome::kGood;
  }

  Outcome Recall(std::optional<std::uint64_t> key) {
    const auto found = key ? memo_.find(*key) : memo_.end();
    if (found == memo_.end()) return Outcome::kBroken;
    stack_.push_back(found->second);
    return Outcome::kGood;
  }

  // Pushes the result of a known function for its arguments, or kOther for an unknown function.
  Outcome Reduce() {
    const PickleValue* const arguments = Take();
    const PickleValue* const function = Take();
    if (arguments == nullptr || function == nullptr || arguments->kind != Kind::kSequence) {
      return Outcome::kBroken;
    }
    const auto& items = arguments->items;
    const std::string_view called =
        function->kind == Kind::kGlobal ? function->text : std::string_view();
    if (called.ends_with("multiarray._reconstruct")) return Push({.kind = Kind::kArray});
    if (called == "numpy.dtype" && !items.empty() && items[0]->kind == Kind::kText) {
      return Push({.kind = Kind::kType, .type = items[0]->text});
    }
    if (called == "_codecs.encode" && !items.empty() && items[0]->kind == Kind::kText) {
      return PushLatin1(items[0]->text);
    }
    if (called.ends_with("multiarray.scalar") && items.size() == 2) {
      return PushScalar(*items[0], *items[1]);
    }
    return Push({});
  }

  // Pushes bytes from text. Protocol 2 stores each byte as a Latin-1 character, encoded in UTF-8.
  Outcome PushLatin1(std::string_view text) {
    if (!MayMake(text.size())) return Outcome::kBroken;
    std::string bytes;
    for (std::size_t k = 0; k < text.size(); ++k) {
      const auto lead = static_cast<unsigned char>(text[k]);
      if (lead < 0x80) {
        bytes.push_back(text[k]);
      } else if ((lead == 0xC2 || lead == 0xC3) && k + 1 < text.size()) {
        bytes.push_back(static_cast<char>((lead & 3) << 6 | (text[++k] & 0x3F)));
      } else {
        return Outcome::kBroken;
      }
    }
    pickle_.texts_.push_back(std::move(bytes));
    return PushText(pickle_.texts_.back());
  }

  Outcome PushScalar(const PickleValue& type, const PickleValue& content) {
    const auto element = ElementTypeOf(type.type);
    if (!element || content.kind != Kind::kText || content.text.size() < ElementBytes(*element)) {
      return Push({});
    }
    const bool swapped = type.big_endian != kBigEndianMachine;
    return PushNumber(ArrayColumn{*element, swapped, content.text.data(), 0}.Number(0));
  }

  // Sets the state of a NumPy type, (3, '<', ...), or of a NumPy array, (1, shape, type, fortran,
  // content).
  Outcome Build() {
    const PickleValue* const state = Take();
    if (state == nullptr || stack_.empty() || stack_.back() == nullptr) return Outcome::kBroken;
    PickleValue& target = *stack_.back();
    const auto& items = state->items;
    if (state->kind != Kind::kSequence) return Outcome::kGood;
    if (target.kind == Kind::kType && items.size() >= 2) {
      target.big_endian = items[1]->text == ">" || (items[1]->text != "<" && kBigEndianMachine);
    }
    if (target.kind == Kind::kArray && items.size() == 5) {
      if (!MayMake(items[1]->items.size() * sizeof(std::uint64_t))) return Outcome::kBroken;
      target.shape.clear();
      for (const PickleValue* const extent : items[1]->items) {
        const auto count = IdOfNumber(extent->number);
        if (!count) return Outcome::kBroken;
        target.shape.push_back(*count);
      }
      target.type = items[2]->type;
      target.big_endian = items[2]->big_endian;
      target.content = items[4];
    }
    return Outcome::kGood;
  }

  Outcome Step(char operation) {
    switch (operation) {
      case '\x80':  // Protocol.
        return Bytes(1) ? Outcome::kGood : Outcome::kBroken;
      case '\x95':  // Frame.
        return Bytes(8) ? Outcome::kGood : Outcome::kBroken;
      case '(':
        stack_.push_back(nullptr);
        return Outcome::kGood;
      case '0':
        if (stack_.empty()) return Outcome::kBroken;
        stack_.pop_back();
        return Outcome::kGood;
      case 'N':
        return Push({.kind = Kind::kNone});
      case '\x88':
        return PushNumber(1);
      case '\x89':
        return PushNumber(0);
      case 'K':
        return PushNumber(Count(1));
      case 'M':
        return PushNumber(Count(2));
      case 'J':
        return PushLong(4);
      case '\x8a':
        return PushLong(Count(1));
      case '\x8b':
        return PushLong(Count(4));
      case 'G':
        return PushFloat();
      case 'X':
      case 'B':
      case 'T':
        return PushSized(Count(4));
      case '\x8c':
      case 'C':
      case 'U':
        return PushSized(Count(1));
      case '\x8d':
      case '\x8e':
        return PushSized(Count(8));
      case 'c': {
        const auto module = Line();
        return PushGlobal(module, Line());
      }
      case '\x93': {
        const PickleValue* const name = Take();
        const PickleValue* const module = Take();
        if (name == nullptr || module == nullptr) return Outcome::kBroken;
        return PushGlobal(module->text, name->text);
      }
      default:
        return StepOfContainers(operation);
    }
  }

  Outcome StepOfContainers(char operation) {
    switch (operation) {
      case ')':
      case ']':
        return PushSequence(0);
      case '\x85':
        return PushSequence(1);
      case '\x86':
        return PushSequence(2);
      case '\x87':
        return PushSequence(3);
      case 't':
      case 'l':
        return PushToMark(Kind::kSequence);
      case '}':
        return Push({.kind = Kind::kDict});
      case 'd':
        return PushToMark(Kind::kDict);
      case 'a': {
        const PickleValue* const item = Take();
        return Extend(std::vector<const PickleValue*>{item}, Kind::kSequence);
      }
      case 'e':
        return Extend(TakeToMark(), Kind::kSequence);
      case 's': {
        const PickleValue* const value = Take();
        const PickleValue* const key = Take();
        return Extend(std::vector<const PickleValue*>{key, value}, Kind::kDict);
      }
      case 'u':
        return Extend(TakeToMark(), Kind::kDict);
      case 'q':
        return Memoize(Count(1));
      case 'r':
        return Memoize(Count(4));
      case '\x94':
        return Memoize(memo_.size());
      case 'h':
        return Recall(Count(1));
      case 'j':
        return Recall(Count(4));
      case 'R':
        return Reduce();
      case 'b':
        return Build();
      default:
        return Outcome::kUnknown;
    }
  }

  Outcome PushFloat() {
    const auto bytes = Bytes(8);  // Big-endian.
    if (!bytes) return Outcome::kBroken;
    return PushNumber(
        ArrayColumn{ElementType::kFloat64, !kBigEndianMachine, bytes->data(), 0}.Number(0));
  }

  Pickle& pickle_;
  std::string_view rest_;
  const std::string& name_;
  std::vector<PickleValue*> stack_;  // A mark is null.
  std::map<std::uint64_t, PickleValue*> memo_;
  std::size_t made_bytes_ = 0;
};

const PickleValue* PickleValue::Find(std::string_view key) const {
  if (kind != Kind::kDict) return nullptr;
  for (std::size_t k = 0; k + 1 < items.size(); k += 2) {
    if (items[k]->kind == Kind::kText && items[k]->text == key) return items[k + 1];
  }
  return nullptr;
}

absl::StatusOr<std::unique_ptr<Pickle>> Pickle::Parse(std::vector<char> bytes,
                                                      const std::string& name) {
  auto pickle = std::make_unique<Pickle>();
  pickle->bytes_ = std::move(bytes);
  if (absl::Status status = PickleMachine(*pickle, name).Run(); !status.ok()) return status;
  return pickle;
}

bool ColumnOf(const PickleValue& value, ArrayColumn& column, std::size_t& rows) {
  if (value.kind != Kind::kArray || value.shape.size() != 1 || value.content == nullptr ||
      value.content->kind != Kind::kText) {
    return false;
  }
  const auto type = ElementTypeOf(value.type);
  if (!type) return false;
  const std::string_view content = value.content->text;
  if (value.shape[0] != content.size() / ElementBytes(*type) ||
      content.size() % ElementBytes(*type) != 0) {
    return false;
  }
  rows = static_cast<std::size_t>(value.shape[0]);
  column = {*type, value.big_endian != kBigEndianMachine, content.data(), ElementBytes(*type)};
  return true;
}

}  // namespace partiemc::client::input
