// Disjoint sets of nodes with images: a union-find structure whose links have offsets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace partiemc {

/// An image of a periodic box: its offset along x, y, z, in lengths of the box.
using Image = std::array<std::int64_t, 3>;

inline Image operator+(const Image& a, const Image& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Image operator-(const Image& a, const Image& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// Sets of nodes that are connected across the faces of a periodic box. Each node has an image
/// relative to the root of its set.
class ImageSets {
 public:
  /// Makes one set for each of `count` nodes.
  void Reset(std::size_t count) {
    parent_.resize(count);
    std::iota(parent_.begin(), parent_.end(), 0u);
    image_.assign(count, Image{});
  }

  struct Found {
    std::uint32_t root;
    Image image;  ///< The image of the node if the root is in image 0.
  };

  /// Finds the root of a node, and halves the path to it. Cost: almost constant on average.
  Found Find(std::uint32_t node) {
    Image image{};
    while (parent_[node] != node) {
      const std::uint32_t above = parent_[node];
      if (parent_[above] != above) {
        image_[node] = image_[node] + image_[above];
        parent_[node] = parent_[above];
      }
      image = image + image_[node];
      node = parent_[node];
    }
    return {node, image};
  }

  /// Joins the sets of two nodes, so that node `b` lies `offset` beyond node `a`. Requires:
  /// different roots. The smaller root remains, so the roots depend only on the sets.
  void Join(const Found& a, const Found& b, const Image& offset) {
    const Image of_root = a.image + offset - b.image;  // Of b's root, seen from a's root.
    if (a.root < b.root) {
      parent_[b.root] = a.root;
      image_[b.root] = of_root;
    } else {
      parent_[a.root] = b.root;
      image_[a.root] = Image{} - of_root;
    }
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<Image> image_;  // Relative to the parent.
};

}  // namespace partiemc
