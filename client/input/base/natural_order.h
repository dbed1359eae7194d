// The order of file names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace partiemc::client {

/// Order of names as people number them: runs of digits compare by value, "frame_2" < "frame_10".
/// A strict weak order; names that differ only in leading zeros are ordered as text.
bool NaturalLess(std::string_view a, std::string_view b);

/// Sorts names of a series by NaturalLess, but compares digits after "<digits>." as the fraction of
/// a decimal number where they have different lengths: "p_0.05" < "p_0.1". They are whole numbers
/// if they are part of three or more numbers ("1.2.10"), or if one of them ends with 0 and none
/// longer than the shortest begins with 0 ("run1.9" < "run1.10"). Returns true if the two ways
/// differ in the order and no name decides between them.
bool SortNaturally(std::vector<std::string>& names);

}  // namespace partiemc::client
