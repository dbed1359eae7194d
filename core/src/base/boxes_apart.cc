#include "base/boxes_apart.h"

#include <cstddef>
#include <numeric>

namespace partiemc {
namespace {

// Boxes that the sweep looks at for each one that begins.
constexpr std::size_t kMaxOpen = 32;

}  // namespace

void FindBoxesApart(std::span<const Box> boxes, BoxesApartScratch& scratch,
                    std::vector<std::uint8_t>& is_apart) {
  is_apart.assign(boxes.size(), 1);
  std::vector<std::uint32_t>& order = scratch.order;
  order.resize(boxes.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return boxes[a].left != boxes[b].left ? boxes[a].left < boxes[b].left : a < b;
  });
  // Boxes that begin left of the sweep and end right of it. Those that found no place are near
  // others, and so is whatever begins before they end.
  std::vector<std::uint32_t>& open = scratch.open;
  open.clear();
  double crowded_until = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t index : order) {
    const Box& box = boxes[index];
    std::erase_if(open, [&](std::uint32_t other) { return boxes[other].right < box.left; });
    for (const std::uint32_t other : open) {
      if (BoxesTouch(box, boxes[other])) is_apart[index] = is_apart[other] = 0;
    }
    if (box.left <= crowded_until) is_apart[index] = 0;
    if (open.size() < kMaxOpen) {
      open.push_back(index);
    } else {
      is_apart[index] = 0;
      crowded_until = std::max(crowded_until, box.right);
    }
  }
}

}  // namespace partiemc
