#include "relay/forging_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <utility>

#include "server/relay/nats_bus.h"
#include "server/relay/pieces.h"
#include "server/relay/relay_port.h"

namespace partiemc::server {

using std::chrono::milliseconds;

ForgingPeer::ForgingPeer(const std::string& url, std::string stream_name)
    : name_(std::move(stream_name)) {
  auto bus = ConnectToNats(url);
  EXPECT_TRUE(bus.ok()) << bus.status();
  bus_ = *std::move(bus);
  subscription_ = bus_->Subscribe(
      SubjectOfAsking(replica_),
      [asked = asked_, joiner = std::make_shared<PieceJoiner>(1 << 16)](std::string_view piece) {
        const auto whole = joiner->Add(piece);
        relay::v1::RelayMessage message;
        if (!whole || !message.ParseFromString(*whole) || !message.has_fetch()) return;
        const std::lock_guard lock(asked->mutex);
        asked->fetches.push_back(std::move(message));
      });
  thread_ = std::thread([this] { Run(); });
}

ForgingPeer::~ForgingPeer() {
  ends_ = true;
  thread_.join();
}

void ForgingPeer::Publish(std::string frame) {
  const std::lock_guard lock(mutex_);
  frames_.push_back(std::move(frame));
  SendResult(SubjectOfResults(stream_id_), frames_.size(), 0, false);
}

// Announces the stream and answers fetches.
void ForgingPeer::Run() {
  for (int turn = 0; !ends_; ++turn) {
    std::vector<relay::v1::RelayMessage> fetches;
    {
      const std::lock_guard lock(asked_->mutex);
      fetches.swap(asked_->fetches);
    }
    {
      const std::lock_guard lock(mutex_);
      for (const relay::v1::RelayMessage& message : fetches) Answer(message);
      if (turn % 20 == 0) {
        relay::v1::RelayMessage message;
        relay::v1::LiveStream& stream = *message.mutable_announcement()->add_streams();
        stream.set_lineage("forged");
        stream.set_opened_unix_ms(1);
        stream.mutable_summary()->set_stream_id(stream_id_);
        stream.mutable_summary()->set_stream_name(name_);
        stream.mutable_summary()->mutable_parameters()->set_output(v1::OUTPUT_SURFACE);
        Send(kReplicasSubject, std::move(message));
      }
    }
    std::this_thread::sleep_for(milliseconds(5));
  }
}

void ForgingPeer::Answer(const relay::v1::RelayMessage& message) {
  const relay::v1::Fetch& fetch = message.fetch();
  const std::string subject = SubjectOfAnswers(message.replica());
  std::uint64_t first = frames_.size() + 1;
  if (fetch.has_number()) first = fetch.number();
  if (fetch.has_sequence()) first = fetch.sequence();
  if (fetch.newest()) first = frames_.size();
  first = std::max<std::uint64_t>(first, 1);
  for (std::uint64_t k = first; k <= frames_.size(); ++k) {
    SendResult(subject, k, fetch.fetch(), k == first);
  }
  relay::v1::RelayMessage end;
  end.mutable_fetch_end()->set_stream_id(stream_id_);
  end.mutable_fetch_end()->set_fetch(fetch.fetch());
  end.mutable_fetch_end()->set_last_number(frames_.size());
  Send(subject, std::move(end));
}

void ForgingPeer::SendResult(const std::string& subject, std::uint64_t number, std::uint64_t fetch,
                             bool first) {
  relay::v1::RelayMessage message;
  relay::v1::Result& result = *message.mutable_result();
  result.set_stream_id(stream_id_);
  result.set_number(number);
  result.set_sequence(number);
  result.set_oldest_sequence(1);
  result.set_frame(frames_[number - 1]);
  result.set_fetch(fetch);
  result.set_first(first);
  Send(subject, std::move(message));
}

void ForgingPeer::Send(const std::string& subject, relay::v1::RelayMessage message) {
  message.set_replica(replica_);
  SendInPieces(replica_, ++sent_, message.SerializeAsString(),
               [&](std::string_view piece) { return bus_->Publish(subject, piece); });
}

}  // namespace partiemc::server
