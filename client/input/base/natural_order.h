// The order of file names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace partiemc::client {

/// Order of names as people number them: runs of digits compare by value, "frame_2" < "frame_10".
/// A strict weak order; names that differ only in leading zeros are ordered as text.
bool NaturalLess(std::string_view a, std::string_view b);

/// Sorts names of a series by NaturalLess. Exception: digits after "<digits>." compare as a decimal
/// fraction if their lengths differ between names: "p_0.05" < "p_0.1". They still compare as whole
/// numbers in two cases. Points join three or more numbers ("1.2.10"). Or digits of one name end
/// with 0, and no digits longer than the shortest begin with 0 ("run1.9" < "run1.10"). Returns true
/// if fractions change the order and the names do not show that they are fractions.
bool SortNaturally(std::vector<std::string>& names);

}  // namespace partiemc::client
