#include "client/input/base/text.h"

#include <string>

namespace partiemc::client::input {

bool Contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

absl::Status WithPrefix(std::string_view prefix, const absl::Status& status) {
  return absl::Status(status.code(), Concat(prefix, ": ", std::string(status.message())));
}

}  // namespace partiemc::client::input
