#include "server/connections/acceptor.h"

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace partiemc::server {
namespace {

// Pause after AcceptAll has returned false. New connections then wait in the kernel.
constexpr std::chrono::milliseconds kPause(100);

}  // namespace

absl::StatusOr<std::unique_ptr<Acceptor>> Acceptor::Listen(const Address& address,
                                                           std::chrono::milliseconds dead_after,
                                                           ConnectionWatch& watch) {
  auto listeners = ListenOn(address, dead_after);
  if (!listeners.ok()) {
    return absl::UnavailableError(absl::StrCat("cannot listen on ", address.ToString(), ": ",
                                               listeners.status().message(),
                                               "; choose another --address"));
  }
  return std::unique_ptr<Acceptor>(new Acceptor(address, *std::move(listeners), watch));
}

Acceptor::Acceptor(Address address, Listeners listeners, ConnectionWatch& watch)
    : address_(std::move(address)),
      port_(listeners.port),
      watch_(watch),
      sockets_(std::move(listeners.sockets)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Acceptor::~Acceptor() {
  StopListening();
  watch_.EndWaiting();  // Their hand-over would use this object.
}

void Acceptor::Start(HandOver hand_over) {
  hand_over_ = std::make_unique<HandOverThreads>(std::move(hand_over));
  thread_ = std::thread([this] { Run(); });
}

void Acceptor::StopListening() {
  eventfd_write(wake_.get(), 1);
  if (thread_.joinable()) thread_.join();
  if (sockets_.empty()) return;
  sockets_.clear();
  if (!address_.unix_path.empty()) unlink(address_.unix_path.c_str());
}

void Acceptor::Run() {
  pthread_setname_np(pthread_self(), "acceptor");
  std::vector<pollfd> ready = {{wake_.get(), POLLIN, 0}};
  for (const Descriptor& socket : sockets_) ready.push_back({socket.get(), POLLIN, 0});
  bool full = false;
  while (true) {
    // During the pause polls only the first descriptor (the stop signal). The listening sockets
    // stay ready, so polling them would make this loop spin.
    const nfds_t count = full ? 1 : ready.size();
    if (poll(ready.data(), count, full ? static_cast<int>(kPause.count()) : -1) < 0) continue;
    if ((ready[0].revents & POLLIN) != 0) return;
    full = false;
    for (std::size_t k = 1; k < ready.size(); ++k) {
      if (!AcceptAll(ready[k].fd)) full = true;
    }
  }
}

// Accepts all waiting connections. Returns false if the process lacks descriptors or memory and no
// idle connection could be evicted.
bool Acceptor::AcceptAll(int listener) {
  while (true) {
    Descriptor socket(accept4(listener, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (socket.get() >= 0) {
      watch_.Add(std::move(socket), [this](Descriptor one) { hand_over_->Add(one.release()); });
    } else if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
      return watch_.EvictIdle();
    } else if (errno != EINTR && errno != ECONNABORTED) {
      return true;
    }
  }
}

}  // namespace partiemc::server
