#include "base/boxes_apart.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "support/random.h"

namespace partiemc {
namespace {

std::vector<std::uint8_t> FoundApart(const std::vector<Box>& boxes) {
  BoxesApartScratch scratch;
  std::vector<std::uint8_t> is_apart;
  FindBoxesApart(boxes, scratch, is_apart);
  return is_apart;
}

// By all pairs, by their corners.
std::vector<std::uint8_t> TrulyApart(const std::vector<Box>& boxes) {
  std::vector<std::uint8_t> is_apart(boxes.size(), 1);
  for (std::size_t a = 0; a < boxes.size(); ++a) {
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const bool is_beside = boxes[a].right < boxes[b].left || boxes[b].right < boxes[a].left;
      const bool is_above = boxes[a].top < boxes[b].bottom || boxes[b].top < boxes[a].bottom;
      if (a != b && !is_beside && !is_above) is_apart[a] = 0;
    }
  }
  return is_apart;
}

// Corners on a small lattice, so that many boxes share a border or a corner.
std::vector<Box> RandomBoxes(support::Random& random, std::size_t count, std::size_t width) {
  std::vector<Box> boxes(count);
  for (Box& box : boxes) {
    const auto x = static_cast<double>(random.Below(width));
    const auto y = static_cast<double>(random.Below(width));
    box.Add({x, y});
    box.Add({x + static_cast<double>(random.Below(5)), y + static_cast<double>(random.Below(5))});
  }
  return boxes;
}

TEST(BoxesApart, AreThoseThatTouchNoOther) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    const std::vector<Box> boxes = RandomBoxes(random, random.Below(60), 10 + random.Below(60));
    EXPECT_EQ(FoundApart(boxes), TrulyApart(boxes));
  }
}

TEST(BoxesApart, NoneThatTouchesAnotherIsCalledApartInACrowd) {
  std::size_t found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    support::Random random(seed);
    std::vector<Box> boxes = RandomBoxes(random, 500, 100);
    // A crowd over the left half, of boxes that touch nothing.
    for (int k = 0; k < 100; ++k) boxes.push_back({0, 200.0 + 2 * k, 50, 201.0 + 2 * k});
    const std::vector<std::uint8_t> apart = FoundApart(boxes);
    const std::vector<std::uint8_t> truly = TrulyApart(boxes);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      EXPECT_LE(apart[k], truly[k]) << "box " << k;
      found += apart[k];
    }
  }
  EXPECT_GT(found, 0u);  // Right of the crowd.
}

}  // namespace
}  // namespace partiemc
