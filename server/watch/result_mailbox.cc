#include "server/watch/result_mailbox.h"

#include <utility>

namespace partiemc::server {

void ResultMailbox::Put(Published published) {
  const std::size_t bytes = published.pending_bytes();
  auto* const post = new Post{std::move(published), nullptr, bytes};
  // Takes the list out of the mailbox before it links the new frame, so that no other thread
  // accesses the list at the same time. No other frame can be added between the two exchanges,
  // because only one thread calls Put.
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
  Post* oldest = nullptr;  // The reversed list: each post points to the newer one.
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
