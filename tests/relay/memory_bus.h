// An in-memory bus that can lose messages and connections.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/relay/message_bus.h"

namespace partiemc::server {

/// Connects the ends of the bus. Thread-safe; outlives its ends.
class MemoryHub {
 public:
  /// True if the message to this subject is lost.
  using Loses = std::function<bool(const std::string& subject, std::string_view message)>;

  class End;

  std::unique_ptr<End> Connect();
  void SetLoses(Loses loses);

 private:
  friend class End;

  struct Listener {
    const End* end;
    std::string subject;
    MessageBus::Handler handler;
  };

  std::mutex mutex_;  // Guards everything below.
  std::vector<std::shared_ptr<Listener>> listeners_;
  Loses loses_;
};

/// One replica's end. Does not receive its own messages.
class MemoryHub::End final : public MessageBus {
 public:
  explicit End(MemoryHub& hub) : hub_(hub) {}

  bool connected() const override;
  bool Publish(const std::string& subject, std::string_view message) override;
  std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) override;
  void Flush() override {}

  /// A disconnected end neither sends nor receives.
  void SetConnected(bool connected);

 private:
  friend class MemoryHub;

  MemoryHub& hub_;
  bool connected_ = true;  // Guarded by the hub's mutex.
};

}  // namespace partiemc::server
