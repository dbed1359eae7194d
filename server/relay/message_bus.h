// A publish-subscribe bus between replicas. Messages can be lost; messages of one sender arrive in
// order.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace partiemc::server {

/// Thread-safe.
class MessageBus {
 public:
  using Handler = std::function<void(std::string_view message)>;

  /// Subscribed during its lifetime. The handler may still be called shortly afterwards, so it must
  /// own everything that it uses.
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };

  virtual ~MessageBus() = default;

  virtual bool connected() const = 0;
  /// May block briefly. Returns false if the message was certainly lost.
  virtual bool Publish(const std::string& subject, std::string_view message) = 0;
  /// Calls `handler` from a thread of the bus; it must not block for long or end subscriptions. The
  /// subscription survives reconnections. Returns null if memory is exhausted.
  virtual std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) = 0;
  /// Waits until published messages are sent, at most one second.
  virtual void Flush() = 0;
};

}  // namespace partiemc::server
