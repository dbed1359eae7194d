#include "server/watch/result_mailbox.h"

#include <utility>

namespace partiemc::server {

void ResultMailbox::Put(Published published) {
  const std::size_t bytes = published.frame->bytes() + kPublishedBytes;
  auto* const post = new Post{std::move(published), nullptr, bytes};
  // Taken back first, so that nobody else is at them while they are linked. Nothing can come
  // between the two exchanges: there is one who puts.
  Post* const older = posts_.exchange(nullptr);
  if (older != nullptr) {
    if (older->bytes + bytes <= max_bytes_) {
      post->older = older;
      post->bytes += older->bytes;
    } else {
      Delete(older);
    }
  }
  posts_ = post;
}

void ResultMailbox::Take(absl::FunctionRef<void(Published)> taker) {
  Post* oldest = nullptr;  // The list turned round: each leads to the newer one.
  for (Post* post = posts_.exchange(nullptr); post != nullptr;) {
    Post* const older = std::exchange(post->older, oldest);
    oldest = std::exchange(post, older);
  }
  for (Post* post = oldest; post != nullptr;) {
    taker(std::move(post->published));
    delete std::exchange(post, post->older);
  }
}

void ResultMailbox::Delete(Post* newest) {
  while (newest != nullptr) delete std::exchange(newest, newest->older);
}

}  // namespace partiemc::server
