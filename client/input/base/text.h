// Text for readers of files, beside common/text.h.
#pragma once

#include <string_view>

#include "absl/status/status.h"
#include "client/output/text.h"
#include "common/text.h"

namespace partiemc::client::input {

bool Contains(std::string_view text, std::string_view part);

/// `text` without the blanks at its front. Cheaper than Strip for text that is parsed from the
/// front, because it does not search the end.
std::string_view StripFront(std::string_view text);

/// `status` with "PREFIX: " before its message.
absl::Status WithPrefix(std::string_view prefix, const absl::Status& status);

}  // namespace partiemc::client::input
