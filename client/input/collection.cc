#include "client/input/collection.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_replace.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxCollectionBytes = std::size_t{64} << 20;

struct Member {
  std::string file;
  std::optional<double> time;
};

absl::StatusOr<std::string> ReadText(const std::string& path) {
  const auto file = OpenFile(path);
  if (!file.ok()) return file.status();
  std::vector<char> bytes;
  if (absl::Status status = ReadUpTo(**file, kMaxCollectionBytes + 1, bytes); !status.ok()) {
    return status;
  }
  if (bytes.size() > kMaxCollectionBytes) {
    return absl::ResourceExhaustedError(Concat(path, ": is a collection of over 64 MiB"));
  }
  return std::string(bytes.begin(), bytes.end());
}

std::string WithoutXmlComments(std::string_view text) {
  std::string kept;
  while (true) {
    const std::size_t begin = text.find("<!--");
    kept += text.substr(0, begin);
    const std::size_t end = begin == std::string_view::npos ? begin : text.find("-->", begin);
    if (end == std::string_view::npos) return kept;
    text.remove_prefix(end + 3);
  }
}

// Takes NAME="VALUE" from the front of an element. Returns false at its end.
bool TakeXmlAttribute(std::string_view& element, std::string_view& name, std::string& value) {
  // Stops at the next element, so that the cost is linear in the text.
  const std::size_t equals = element.find_first_of("=<>");
  if (equals == std::string_view::npos || element[equals] != '=') return false;
  const std::size_t open = element.find_first_not_of(" \t\r\n", equals + 1);
  if (open == std::string_view::npos || (element[open] != '"' && element[open] != '\''))
    return false;
  const std::size_t close = element.find(element[open], open + 1);
  if (close == std::string_view::npos) return false;
  name = Strip(element.substr(0, equals));
  value = absl::StrReplaceAll(
      std::string(element.substr(open + 1, close - open - 1)),
      {{"&amp;", "&"}, {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&apos;", "'"}});
  element.remove_prefix(close + 1);
  return true;
}

// <DataSet timestep="0.5" part="0" file="frame.vtp"/>
std::vector<Member> MembersOfPvd(std::string_view text) {
  const std::string kept = WithoutXmlComments(text);
  std::string_view rest = kept;
  constexpr std::string_view kElement = "<DataSet";
  std::vector<Member> members;
  for (std::size_t at = rest.find(kElement); at != std::string_view::npos;
       at = rest.find(kElement)) {
    rest.remove_prefix(at + kElement.size());
    Member member;
    std::string_view name;
    std::string value;
    while (TakeXmlAttribute(rest, name, value)) {
      if (name == "file") member.file = value;
      if (name == "timestep") member.time = ParseNumber(Strip(value));
    }
    members.push_back(std::move(member));
  }
  return members;
}

void AppendUtf8(char32_t point, std::string& text) {
  const auto continuation = [&](int shift) {
    text.push_back(static_cast<char>(0x80 | (point >> shift & 0x3f)));
  };
  if (point < 0x80) {
    text.push_back(static_cast<char>(point));
  } else if (point < 0x800) {
    text.push_back(static_cast<char>(0xc0 | point >> 6));
    continuation(0);
  } else if (point < 0x10000) {
    text.push_back(static_cast<char>(0xe0 | point >> 12));
    continuation(6);
    continuation(0);
  } else {
    text.push_back(static_cast<char>(0xf0 | point >> 18));
    continuation(12);
    continuation(6);
    continuation(0);
  }
}

// Takes the digits of "\uXXXX" from the front, or of two escapes that are a surrogate pair. Returns
// U+FFFD for other surrogates and for wrong digits.
char32_t TakeUnicodeEscape(std::string_view& rest) {
  constexpr char32_t kReplacement = 0xfffd;
  const auto unit = [&rest]() -> char32_t {
    const std::string_view digits = rest.substr(0, 4);
    const char* const end = digits.data() + digits.size();
    std::uint32_t value = 0;
    const auto parsed = std::from_chars(digits.data(), end, value, 16);
    if (digits.size() < 4 || parsed.ec != std::errc() || parsed.ptr != end) return kReplacement;
    rest.remove_prefix(4);
    return value;
  };
  const char32_t first = unit();
  if (first < 0xd800 || first > 0xdfff) return first;
  if (first > 0xdbff || !rest.starts_with("\\u")) return kReplacement;
  std::string_view after = std::exchange(rest, rest.substr(2));
  const char32_t second = unit();
  if (second >= 0xdc00 && second <= 0xdfff) {
    return 0x10000 + ((first - 0xd800) << 10 | (second - 0xdc00));
  }
  rest = after;  // The second escape is a character of its own.
  return kReplacement;
}

// Reads a JSON string after its opening quote.
bool TakeJsonString(std::string_view& rest, std::string& text) {
  text.clear();
  while (!rest.empty()) {
    const char c = rest.front();
    rest.remove_prefix(1);
    if (c == '"') return true;
    if (c != '\\' || rest.empty()) {
      text.push_back(c);
      continue;
    }
    const char escape = rest.front();
    rest.remove_prefix(1);
    constexpr std::string_view kEscapes = "bfnrt", kMeanings = "\b\f\n\r\t";
    const std::size_t known = kEscapes.find(escape);
    if (escape == 'u') {
      AppendUtf8(TakeUnicodeEscape(rest), text);
    } else {
      text.push_back(known == std::string_view::npos ? escape : kMeanings[known]);
    }
  }
  return false;
}

// {"file-series-version": "1.0", "files": [{"name": "frame.vtp", "time": 0.5}]}
std::vector<Member> MembersOfSeries(std::string_view rest) {
  std::vector<Member> members;
  Member member;
  std::string key, text;
  while (!rest.empty()) {
    const char c = rest.front();
    if (c == '"') {
      rest.remove_prefix(1);
      if (!TakeJsonString(rest, text)) break;
      const std::string_view next = StripFront(rest);
      if (next.starts_with(':')) {
        key = std::exchange(text, {});
      } else if (key == "name") {
        member.file = std::exchange(text, {});
      }
    } else if (absl::ascii_isdigit(static_cast<unsigned char>(c)) || c == '-') {
      const std::size_t end = std::min(rest.find_first_not_of("+-.eE0123456789"), rest.size());
      if (key == "time") member.time = ParseNumber(rest.substr(0, end));
      rest.remove_prefix(end);
    } else {
      if (c == '}' && !member.file.empty()) members.push_back(std::exchange(member, {}));
      rest.remove_prefix(1);
    }
  }
  return members;
}

std::string ExtensionOf(const std::string& path) {
  return absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
}

}  // namespace

bool IsCollectionName(const std::string& path) {
  const std::string extension = ExtensionOf(path);
  return extension == ".pvd" || extension == ".series";
}

absl::StatusOr<std::optional<Collection>> ReadCollection(const std::string& path) {
  std::error_code error;
  if (!IsCollectionName(path) || !std::filesystem::is_regular_file(path, error)) {
    return std::nullopt;
  }
  const auto text = ReadText(path);
  if (!text.ok()) return text.status();
  std::vector<Member> members =
      ExtensionOf(path) == ".pvd" ? MembersOfPvd(*text) : MembersOfSeries(*text);
  if (members.empty()) {
    return absl::DataLossError(Concat(path, ": is a collection without files"));
  }
  for (const Member& member : members) {
    if (member.file.empty() || !member.time || !std::isfinite(*member.time)) {
      return absl::DataLossError(
          Concat(path, ": an entry must have a file and a time; '", member.file, "' has not"));
    }
  }
  std::stable_sort(members.begin(), members.end(),
                   [](const Member& a, const Member& b) { return *a.time < *b.time; });
  Collection collection;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (k > 0 && *members[k].time == *members[k - 1].time) {
      return absl::DataLossError(Concat(path, ": has several files at time ", *members[k].time,
                                        "; parts of a frame are not joined, write one file"));
    }
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    collection.files.push_back((folder / members[k].file).string());
    collection.times[k] = *members[k].time;
  }
  return collection;
}

}  // namespace partiemc::client::input
