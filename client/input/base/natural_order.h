// The order of file names.
#pragma once

#include <string_view>

namespace partiemc::client {

/// Order of names as people number them: runs of digits compare by value, "frame_2" < "frame_10".
/// A strict weak order; names that differ only in leading zeros are ordered as text.
bool NaturalLess(std::string_view a, std::string_view b);

}  // namespace partiemc::client
