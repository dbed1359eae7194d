#include "relay/memory_bus.h"

#include <algorithm>
#include <utility>

namespace partiemc::server {

std::unique_ptr<MemoryHub::End> MemoryHub::Connect() { return std::make_unique<End>(*this); }

void MemoryHub::SetLoses(Loses loses) {
  const std::lock_guard lock(mutex_);
  loses_ = std::move(loses);
}

bool MemoryHub::End::connected() const {
  const std::lock_guard lock(hub_.mutex_);
  return connected_;
}

void MemoryHub::End::SetConnected(bool connected) {
  const std::lock_guard lock(hub_.mutex_);
  connected_ = connected;
}

bool MemoryHub::End::Publish(const std::string& subject, std::string_view message) {
  const std::lock_guard lock(hub_.mutex_);
  if (!connected_) return false;
  if (hub_.loses_ && hub_.loses_(subject, message)) return true;
  for (const auto& listener : hub_.listeners_) {
    const bool hears = listener->end != this && listener->end->connected_;
    if (hears && listener->subject == subject) listener->handler(message);
  }
  return true;
}

std::unique_ptr<MessageBus::Subscription> MemoryHub::End::Subscribe(const std::string& subject,
                                                                    Handler handler) {
  class Listening final : public Subscription {
   public:
    Listening(MemoryHub& hub, std::shared_ptr<Listener> listener)
        : hub_(hub), listener_(std::move(listener)) {}
    ~Listening() override {
      const std::lock_guard lock(hub_.mutex_);
      std::erase(hub_.listeners_, listener_);
    }

   private:
    MemoryHub& hub_;
    const std::shared_ptr<Listener> listener_;
  };
  auto listener = std::make_shared<Listener>(Listener{this, subject, std::move(handler)});
  const std::lock_guard lock(hub_.mutex_);
  hub_.listeners_.push_back(listener);
  return std::make_unique<Listening>(hub_, std::move(listener));
}

}  // namespace partiemc::server
