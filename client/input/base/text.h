// Text as views of the standard library, which the abseil that distributions ship does not take.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "client/output/text.h"

namespace partiemc::client::input {

/// `text` without blanks at both ends.
std::string_view Strip(std::string_view text);

bool Contains(std::string_view text, std::string_view part);

/// The parts between separators, blanks stripped; one empty part for an empty text.
std::vector<std::string_view> Split(std::string_view text, char separator);

/// `status` with "PREFIX: " before its message.
absl::Status WithPrefix(std::string_view prefix, const absl::Status& status);

}  // namespace partiemc::client::input
