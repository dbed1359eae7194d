#include "client/input/base/text.h"

#include <algorithm>
#include <string>

namespace partiemc::client::input {

bool Contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

std::string_view StripFront(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of(kAsciiBlanks), text.size()));
}

absl::Status WithPrefix(std::string_view prefix, const absl::Status& status) {
  return absl::Status(status.code(), Concat(prefix, ": ", std::string(status.message())));
}

}  // namespace partiemc::client::input
