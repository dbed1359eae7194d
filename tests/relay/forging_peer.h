// A peer on the bus that announces a stream of surfaces, whose results are any bytes.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/relay/v1/relay.pb.h"
#include "server/relay/message_bus.h"

namespace partiemc::server {

class ForgingPeer {
 public:
  /// Connects to NATS at `url`, and announces the stream until the end.
  ForgingPeer(const std::string& url, std::string stream_name);
  ~ForgingPeer();
  ForgingPeer(const ForgingPeer&) = delete;
  ForgingPeer& operator=(const ForgingPeer&) = delete;

  /// Publishes the next result: any bytes instead of a serialised ReconstructedFrame.
  void Publish(std::string frame);

 private:
  // The handler of the bus fills it, and may outlive this object.
  struct Asked {
    std::mutex mutex;
    std::vector<relay::v1::RelayMessage> fetches;
  };

  void Run();
  void Answer(const relay::v1::RelayMessage& message);
  void SendResult(const std::string& subject, std::uint64_t number, std::uint64_t fetch,
                  bool first);
  void Send(const std::string& subject, relay::v1::RelayMessage message);

  const std::string name_, replica_ = "forging", stream_id_ = "forged-1";
  std::unique_ptr<MessageBus> bus_;
  const std::shared_ptr<Asked> asked_ = std::make_shared<Asked>();
  std::unique_ptr<MessageBus::Subscription> subscription_;
  std::mutex mutex_;
  std::vector<std::string> frames_;  // Guarded by the mutex, as `sent_`.
  std::uint64_t sent_ = 0;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

}  // namespace partiemc::server
