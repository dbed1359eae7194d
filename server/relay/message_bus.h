// A publish-subscribe bus between replicas. Messages may be lost, but messages of one sender arrive
// in order.
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

  /// A subscription lasts until this object is destroyed. The handler may still be called shortly
  /// afterwards, so it must own everything that it uses.
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };

  virtual ~MessageBus() = default;

  virtual bool connected() const = 0;
  /// Sends a message; may block briefly. Returns false if the message was certainly lost. If it
  /// returns true, the message may still be lost.
  virtual bool Publish(const std::string& subject, std::string_view message) = 0;
  /// Subscribes to a subject. A thread of the bus calls `handler`, which must not block for long
  /// and must not end subscriptions. The subscription survives reconnections. Returns null if
  /// memory is exhausted.
  virtual std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) = 0;
  /// Waits until all published messages are sent, at most one second.
  virtual void Flush() = 0;
};

}  // namespace partiemc::server
