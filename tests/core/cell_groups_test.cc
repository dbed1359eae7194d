#include "periodic/cell_groups.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <vector>

#include "support/random.h"

namespace partiemc {
namespace {

using support::Random;

// The groups in a map.
void ExpectGroups(const std::vector<GridCell>& cells, CellGroups& groups) {
  std::map<GridCell, std::vector<std::uint32_t>> expected;
  for (std::uint32_t item = 0; item < cells.size(); ++item) expected[cells[item]].push_back(item);
  ASSERT_EQ(groups.Find(cells), expected.size());
  groups.Sort(cells);
  ASSERT_EQ(groups.groups().size(), expected.size());
  ASSERT_EQ(groups.items().size(), cells.size());
  std::uint32_t index = 0, first = 0;
  for (const auto& [cell, items] : expected) {
    const CellGroups::Group& group = groups.groups()[index];
    EXPECT_EQ(group.cell, cell);
    EXPECT_EQ(group.first, first);
    first = group.last;
    const auto members = groups.items().subspan(group.first, group.last - group.first);
    EXPECT_EQ(std::vector(members.begin(), members.end()), items);
    EXPECT_EQ(groups.GroupOf(cell), index++);
  }
}

TEST(CellGroups, AreThoseOfAMap) {
  CellGroups groups;  // Reused: no call may see what an earlier one has left.
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const std::int32_t reach = seed % 3 == 0 ? 1 << 30 : seed % 3 == 1 ? 8 : 1;
    const std::size_t count = random.Below(200);
    std::vector<GridCell> cells(count);
    for (GridCell& cell : cells) {
      for (std::int32_t& at : cell) {
        at = static_cast<std::int32_t>(random.Below(2 * std::uint64_t(reach))) - reach;
      }
    }
    ExpectGroups(cells, groups);
    EXPECT_EQ(groups.GroupOf({1 << 30, 1, 1}), CellGroups::kNone);
  }
}

}  // namespace
}  // namespace partiemc
