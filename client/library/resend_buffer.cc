#include "client/library/resend_buffer.h"

#include <utility>

namespace partiemc::client {

void ResendBuffer::Add(grpc::ByteBuffer request) {
  bytes_ += request.Length();
  requests_.push_back(std::move(request));
}

void ResendBuffer::DropBelow(std::uint64_t sequence) {
  while (first_ < sequence && !requests_.empty()) {
    bytes_ -= requests_.front().Length();
    requests_.pop_front();
    ++first_;
  }
}

}  // namespace partiemc::client
