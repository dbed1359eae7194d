#include "server/watch/result_mailbox.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {

void ResultMailbox::Put(Published published, bool keep_older) {
  const std::size_t bytes = published.frame->bytes() + kPublishedBytes;
  auto* const post = new Post{std::move(published), nullptr, bytes};
  // Taken back first, so that nobody else is at them while they are linked. Only PutBack can come
  // between the two exchanges, and what it puts is older than this frame.
  Post* const older = posts_.exchange(nullptr);
  if (older != nullptr) {
    if (keep_older && older->bytes + bytes <= max_bytes_) {
      post->older = older;
      post->bytes += older->bytes;
    } else {
      Delete(older);
    }
  }
  Delete(posts_.exchange(post));
}

std::vector<Published> ResultMailbox::Take() {
  std::vector<Published> taken;
  Post* const newest = posts_.exchange(nullptr);
  for (const Post* post = newest; post != nullptr; post = post->older) {
    taken.push_back(post->published);
  }
  Delete(newest);
  std::reverse(taken.begin(), taken.end());
  return taken;
}

void ResultMailbox::PutBack(Published published) {
  const std::size_t bytes = published.frame->bytes() + kPublishedBytes;
  auto* const post = new Post{std::move(published), nullptr, bytes};
  Post* nothing = nullptr;
  if (!posts_.compare_exchange_strong(nothing, post)) delete post;
}

void ResultMailbox::Delete(Post* newest) {
  while (newest != nullptr) delete std::exchange(newest, newest->older);
}

}  // namespace partiemc::server
