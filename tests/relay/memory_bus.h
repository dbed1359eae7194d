// A bus in memory, with the faults that a real one has.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "server/relay/message_bus.h"

namespace partiemc::server {

/// What ends of the bus are connected to. Safe from any thread; lives longer than its ends.
class MemoryHub {
 public:
  /// Whether a message to this subject is lost on its way.
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

/// One replica's. What it publishes does not come to itself.
class MemoryHub::End final : public MessageBus {
 public:
  explicit End(MemoryHub& hub) : hub_(hub) {}

  bool connected() const override;
  bool Publish(const std::string& subject, std::string_view message) override;
  std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) override;
  void Flush() override {}

  /// While it is not, nothing comes and goes.
  void SetConnected(bool connected);

 private:
  friend class MemoryHub;

  MemoryHub& hub_;
  bool connected_ = true;  // Guarded by the hub's.
};

}  // namespace partiemc::server
