// What carries messages between replicas: subjects, each with those who listen to it. Messages may
// be lost; those of one sender that come keep their order.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace partiemc::server {

/// Safe from any thread.
class MessageBus {
 public:
  using Handler = std::function<void(std::string_view message)>;

  /// Listens until it goes. Its handler, which therefore owns what it uses, may be called for a
  /// moment longer.
  class Subscription {
   public:
    virtual ~Subscription() = default;
  };

  virtual ~MessageBus() = default;

  virtual bool connected() const = 0;
  /// May wait for a moment. False if the message is lost for certain.
  virtual bool Publish(const std::string& subject, std::string_view message) = 0;
  /// `handler` is called by a thread of the bus, and must not wait for long, nor end subscriptions.
  /// While the bus is not connected nothing comes; it comes again afterwards. Null where there is
  /// no memory.
  virtual std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) = 0;
  /// Waits until what was published is on its way, for a second at most.
  virtual void Flush() = 0;
};

}  // namespace partiemc::server
