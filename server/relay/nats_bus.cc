#include "server/relay/nats_bus.h"

#include <nats/nats.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace partiemc::server {
namespace {

constexpr std::int64_t kConnectTimeoutMs = 1000;
constexpr std::int64_t kReconnectWaitMs = 100, kReconnectJitterMs = 50;
// Write timeout of the connection to NATS.
constexpr std::int64_t kWriteDeadlineMs = 2000;
// Ping interval. When the third ping is due and the first two have no reply, the connection ends.
// So a silent NATS server is detected before the other replicas count as lost (kReplicaPatience).
constexpr std::int64_t kPingIntervalMs = 500;
constexpr int kMaxPingsOut = 2;
constexpr std::int64_t kFlushMs = 1000;
// Limits of the messages that wait for the handler of a subscription. Further messages are lost.
constexpr int kPendingMessages = 65'536, kPendingBytes = 64 << 20;

struct Deleter {
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
  void operator()(natsConnection* connection) const { natsConnection_Destroy(connection); }
};

// A subscription of the NATS library. The library's delivery thread calls the handler and may still
// run it when the subscription ends. Therefore the handler is shared, and its last user deletes it.
class NatsSubscription final : public MessageBus::Subscription {
 public:
  explicit NatsSubscription(MessageBus::Handler handler)
      : handler_(std::make_shared<MessageBus::Handler>(std::move(handler))) {}
  ~NatsSubscription() override {
    if (subscription_ == nullptr) return;
    natsSubscription_Unsubscribe(subscription_);
    natsSubscription_Destroy(subscription_);
  }

  bool Begin(natsConnection* connection, const std::string& subject) {
    auto* const closure = new std::shared_ptr<MessageBus::Handler>(handler_);
    if (natsConnection_Subscribe(&subscription_, connection, subject.c_str(), &Deliver, closure) !=
        NATS_OK) {
      delete closure;
      return false;
    }
    natsSubscription_SetOnCompleteCB(subscription_, &Complete, closure);
    natsSubscription_SetPendingLimits(subscription_, kPendingMessages, kPendingBytes);
    return true;
  }

 private:
  static void Deliver(natsConnection*, natsSubscription*, natsMsg* message, void* closure) {
    const auto& handler = *static_cast<std::shared_ptr<MessageBus::Handler>*>(closure);
    (*handler)(
        {natsMsg_GetData(message), static_cast<std::size_t>(natsMsg_GetDataLength(message))});
    natsMsg_Destroy(message);
  }
  static void Complete(void* closure) {
    delete static_cast<std::shared_ptr<MessageBus::Handler>*>(closure);
  }

  const std::shared_ptr<MessageBus::Handler> handler_;
  natsSubscription* subscription_ = nullptr;
};

class NatsBus final : public MessageBus {
 public:
  explicit NatsBus(std::unique_ptr<natsConnection, Deleter> connection)
      : connection_(std::move(connection)) {}

  bool connected() const override {
    return natsConnection_Status(connection_.get()) == NATS_CONN_STATUS_CONNECTED;
  }
  // Does not publish without a connection: the library would queue the messages and send them much
  // later, all at once.
  bool Publish(const std::string& subject, std::string_view message) override {
    return connected() && natsConnection_Publish(connection_.get(), subject.c_str(), message.data(),
                                                 static_cast<int>(message.size())) == NATS_OK;
  }
  std::unique_ptr<Subscription> Subscribe(const std::string& subject, Handler handler) override {
    auto subscription = std::make_unique<NatsSubscription>(std::move(handler));
    if (!subscription->Begin(connection_.get(), subject)) return nullptr;
    return subscription;
  }
  void Flush() override {
    if (connected()) natsConnection_FlushTimeout(connection_.get(), kFlushMs);
  }

 private:
  const std::unique_ptr<natsConnection, Deleter> connection_;
};

natsStatus SetOptions(natsOptions* options, const std::string& url) {
  std::vector<std::string> urls = absl::StrSplit(url, ',');
  std::vector<const char*> servers;
  for (const std::string& one : urls) servers.push_back(one.c_str());
  natsStatus status =
      natsOptions_SetServers(options, servers.data(), static_cast<int>(servers.size()));
  if (status == NATS_OK && url.starts_with("tls://")) status = natsOptions_SetSecure(options, true);
  if (status == NATS_OK) status = natsOptions_SetName(options, "partiemc-server");
  if (status == NATS_OK) status = natsOptions_SetTimeout(options, kConnectTimeoutMs);
  if (status == NATS_OK) status = natsOptions_SetMaxReconnect(options, -1);
  if (status == NATS_OK) status = natsOptions_SetReconnectWait(options, kReconnectWaitMs);
  if (status == NATS_OK) {
    status = natsOptions_SetReconnectJitter(options, kReconnectJitterMs, kReconnectJitterMs);
  }
  if (status == NATS_OK) {
    status = natsOptions_SetRetryOnFailedConnect(
        options, true, [](natsConnection*, void*) {}, nullptr);
  }
  if (status == NATS_OK) status = natsOptions_SetWriteDeadline(options, kWriteDeadlineMs);
  if (status == NATS_OK) status = natsOptions_SetPingInterval(options, kPingIntervalMs);
  if (status == NATS_OK) status = natsOptions_SetMaxPingsOut(options, kMaxPingsOut);
  // Sends every message at once. By default, the library waits briefly to send several messages
  // together.
  if (status == NATS_OK) status = natsOptions_SetSendAsap(options, true);
  if (status == NATS_OK) status = natsOptions_SetNoEcho(options, true);
  // Uses one delivery thread for all subscriptions. This keeps the order of a replica's messages
  // even if they have different subjects.
  if (status == NATS_OK) status = natsOptions_UseGlobalMessageDelivery(options, true);
  // Installs an empty error handler, because the library would otherwise print errors.
  if (status == NATS_OK) {
    status = natsOptions_SetErrorHandler(
        options, [](natsConnection*, natsSubscription*, natsStatus, void*) {}, nullptr);
  }
  return status;
}

}  // namespace

absl::StatusOr<std::unique_ptr<MessageBus>> ConnectToNats(const std::string& url) {
  natsOptions* made = nullptr;
  natsStatus status = natsOptions_Create(&made);
  const std::unique_ptr<natsOptions, Deleter> options(made);
  if (status == NATS_OK) status = SetOptions(made, url);
  natsConnection* connection = nullptr;
  if (status == NATS_OK) status = natsConnection_Connect(&connection, made);
  if (status != NATS_OK && status != NATS_NOT_YET_CONNECTED) {
    // The URL may contain a password.
    return absl::InvalidArgumentError(
        absl::StrCat("--nats: ", natsStatus_GetText(status),
                     "; it must be nats://HOST:PORT or tls://HOST:PORT"));
  }
  return std::make_unique<NatsBus>(std::unique_ptr<natsConnection, Deleter>(connection));
}

}  // namespace partiemc::server
