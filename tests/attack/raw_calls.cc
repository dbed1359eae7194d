#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <stdexcept>

#include "attack/http2_client.h"
#include "attack/random_calls.h"
#include "attack/requests.h"

namespace partiemc::attack {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr milliseconds kRawCallPatience(2000);
constexpr std::size_t kMostOpen = 48;

template <typename Container>
const auto& OneOf(const Container& container, support::Random& random) {
  return container[random.Below(std::size(container))];
}

class RawCaller {
 public:
  RawCaller(std::string address, const CallMessages& messages, std::uint64_t seed,
            CallCounts& counts)
      : address_(std::move(address)), messages_(messages), random_(seed), counts_(counts) {}

  void Run() {
    while (!counts_.stop && Connected()) {
      for (std::size_t steps = 1 + random_.Below(24); steps > 0; --steps) {
        if (open_.empty() || random_.Chance(0.6)) {
          if (counts_.left-- <= 0) return;
          Begin();
        } else {
          GoOn();
        }
      }
      if (counts_.left <= 0) return;
      client_->Flush(kRawCallPatience, random_.Chance(0.9));
      Pause();
      if (random_.Chance(0.01)) Disturb();
    }
  }

 private:
  struct Call {
    std::uint32_t stream;
    const char* method;
  };

  bool Connected() {
    if (client_ && !client_->closed()) return true;
    open_.clear();
    const auto window = random_.Chance(0.2) ? 0u : 0x7fffffffu;
    try {
      client_ =
          std::make_unique<Http2Client>(address_, Http2Client::Options{.stream_window = window});
    } catch (const std::runtime_error&) {
      return false;  // The server has died; the test decides whether it should have.
    }
    ++counts_.connections;
    client_->OnFrame([this](const ReceivedFrame& frame) {
      if (!frame.EndsStream()) return;
      if (frame.stream == awaited_) awaited_ = 0;
      std::erase_if(open_, [&](const Call& call) { return call.stream == frame.stream; });
    });
    return true;
  }

  void Begin() {
    static constexpr std::array kMethods = {
        kReconstruct, kReconstruct,   kReconstruct, kReconstructFrame, kWatchStream, kWatchStream,
        kListStreams, kGetServerInfo, kHealthCheck, kHealthWatch,      kReflection,  "/no/Such"};
    static constexpr std::array kTimeouts = {"1n", "50u", "300u", "1m", "5m", "20m", "1S"};
    const char* method = OneOf(kMethods, random_);
    Headers more;
    if (random_.Chance(0.2)) more.emplace_back("grpc-timeout", OneOf(kTimeouts, random_));
    const std::string block = HeaderBlock(CallHeaders(method, more));
    std::uint32_t stream = 0;
    if (random_.Chance(0.03)) {
      const std::size_t cut = random_.Below(block.size());
      stream = client_->CallBlock(block.substr(0, cut), 0);
      client_->Frame(FrameType::kContinuation, kEndHeaders, stream, block.substr(cut));
    } else {
      const bool ends = random_.Chance(0.04);
      stream = client_->CallBlock(block,
                                  static_cast<std::uint8_t>(kEndHeaders | (ends ? kEndStream : 0)));
      if (ends) {
        ++counts_.raw;
        return;
      }
    }
    ++counts_.raw;
    const Call call{stream, method};
    bool is_open = true;
    for (std::size_t sent = random_.Below(4); sent > 0 && is_open; --sent) is_open = Send(call);
    if (is_open && random_.Chance(0.45)) {
      client_->Reset(stream);
    } else if (is_open) {
      if (open_.size() >= kMostOpen) {
        client_->Reset(open_.front().stream);
        open_.erase(open_.begin());
      }
      open_.push_back(call);
    }
  }

  // False after this side has ended.
  bool Send(const Call& call) {
    if (random_.Chance(0.1)) {
      client_->Data(call.stream, "", true);
      return false;
    }
    const std::string& message = Message(call.method);
    if (client_->WindowOf(call.stream) < static_cast<std::int64_t>(message.size())) return true;
    client_->Data(call.stream, message);
    return true;
  }

  const std::string& Message(const std::string& method) {
    if (method == kReconstruct) {
      return OneOf(random_.Chance(0.4) ? messages_.opens : messages_.frames, random_);
    }
    if (method == kWatchStream) {
      return OneOf(random_.Chance(0.6) ? messages_.watches : messages_.credits, random_);
    }
    return OneOf(messages_.unary, random_);
  }

  void GoOn() {
    const std::size_t at = random_.Below(open_.size());
    const Call call = open_[at];
    bool stays = true;
    if (random_.Chance(0.5)) {
      stays = Send(call);
    } else {
      client_->Reset(call.stream);
      stays = false;
    }
    if (!stays) open_.erase(open_.begin() + static_cast<std::ptrdiff_t>(at));
  }

  // Usually until the server has processed the sent frames: a growing queue would reach few states.
  void Pause() {
    if (client_->closed()) return;
    if (random_.Chance(0.7)) {
      awaited_ = client_->Call(CallHeaders(kGetServerInfo));
      ++counts_.raw;
      --counts_.left;
      client_->Data(awaited_, Prefixed(""), true);
      client_->Read(milliseconds(100), [&] { return awaited_ == 0; });
    } else {
      client_->Read(milliseconds(random_.Below(3)));
    }
    if (random_.Chance(0.3)) std::this_thread::sleep_for(microseconds(random_.Below(1500)));
  }

  void Disturb() {
    switch (random_.Below(4)) {
      case 0:
        client_->Bytes(std::string(40, static_cast<char>(random_.Below(256))));
        client_->Flush(kRawCallPatience);
        break;
      case 1:
        client_->GoAway();
        client_->Flush(kRawCallPatience);
        break;
      case 2:
        client_->Close(/*reset=*/true);
        break;
      default:
        client_->Close(/*reset=*/false);
        break;
    }
  }

  const std::string address_;
  const CallMessages& messages_;
  support::Random random_;
  CallCounts& counts_;
  std::unique_ptr<Http2Client> client_;
  std::vector<Call> open_;
  std::uint32_t awaited_ = 0;
};

}  // namespace

CallMessages::CallMessages() {
  constexpr std::size_t kParticles = 60;
  const auto add = [](std::vector<std::string>& to, const auto& message) {
    to.push_back(Prefixed(message.SerializeAsString()));
  };
  for (const char* name : {"", "n0", "n1", "n2"}) add(opens, Open(name));
  for (char k = '0'; k < '4'; ++k) {  // Each takes over from the last one with its token.
    add(opens, Open(std::string("t") + k, std::string(32, k)));
  }
  auto refused = Open("no such name!");
  add(opens, refused);
  refused = Open("n3");
  refused.mutable_open()->mutable_parameters()->set_kernel_radius(100);
  add(opens, refused);
  for (std::uint64_t sequence = 1; sequence <= 6; ++sequence) {
    add(frames, Blob(sequence, 1, kParticles));
  }
  auto bad = Blob(1, 1, kParticles);
  bad.mutable_frame()->mutable_positions()->append("x");
  add(frames, bad);
  bad = Blob(1, 1, kParticles);
  bad.mutable_frame()->set_ids("12345678");
  add(frames, bad);
  add(frames, Blob(77, 1, kParticles));
  frames.push_back(Prefixed(std::string(20, '\xff')));
  frames.push_back(Prefixed(""));
  frames.push_back(
      std::string("\x01\0\0\0\x04"
                  "abcd",
                  9));  // Flagged as compressed.
  frames.push_back(MessagePrefix(1'000'000) + "and no more");
  frames.push_back(MessagePrefix(0xffffffff));
  for (const char* name : {"n0", "n1", "t0", "t1", "t2", "honest-1", "nobody"}) {
    add(watches, Watch(name, 1));
    add(watches, Watch(name, 1000));
  }
  add(watches, Watch("t0", 0));
  v1::WatchStreamRequest credit;
  credit.mutable_credit()->set_frames(3);
  add(credits, credit);
  credits.push_back(Prefixed(""));
  credits.push_back(Prefixed("\xff\xff\xff"));
  add(unary, OneBlob(1, kParticles));
  unary.push_back(Prefixed(""));
  unary.push_back(Prefixed(std::string(20, '\xff')));
  unary.push_back(MessagePrefix(100) + "half");
}

void CallRaw(const std::string& address, const CallMessages& messages, std::uint64_t seed,
             CallCounts& counts) {
  RawCaller(address, messages, seed, counts).Run();
}

}  // namespace partiemc::attack
