#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "attack/random_calls.h"
#include "attack/requests.h"

namespace partiemc::attack {
namespace {

using std::chrono::microseconds;

constexpr std::size_t kAtOnce = 24;

using Stub = grpc::TemplatedGenericStub<grpc::ByteBuffer, grpc::ByteBuffer>;

// Counts calls that have not ended.
class Going {
 public:
  void Enter() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_ < kAtOnce; });
    ++count_;
  }
  void Leave() {
    const std::lock_guard lock(mutex_);
    --count_;
    changed_.notify_all();
  }
  void WaitForNone() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t count_ = 0;
};

// A call of any method with raw messages. Ends at its deadline at the latest.
class RandomCall final : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  RandomCall(Stub& stub, const char* method, std::vector<grpc::ByteBuffer> requests,
             bool half_closes, microseconds deadline, const std::string& token, Going& going)
      : requests_(std::move(requests)), half_closes_(half_closes), going_(going) {
    if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
    context_.set_deadline(std::chrono::system_clock::now() + deadline);
    stub.PrepareBidiStreamingCall(&context_, method, {}, this);
  }

  void Start() {
    AddHold();  // For Cancel.
    StartRead(&answer_);
    WriteNext();
    StartCall();
  }
  // Ends the call.
  void Leave(bool cancels) {
    if (cancels) context_.TryCancel();
    RemoveHold();
  }

  void OnReadDone(bool ok) override {
    if (ok) StartRead(&answer_);
  }
  void OnWriteDone(bool ok) override {
    if (ok) WriteNext();
  }
  void OnDone(const grpc::Status&) override {
    Going& going = going_;
    delete this;
    going.Leave();
  }

 private:
  void WriteNext() {
    if (next_ < requests_.size()) {
      StartWrite(&requests_[next_++]);
    } else if (std::exchange(half_closes_, false)) {
      StartWritesDone();
    }
  }

  grpc::ClientContext context_;
  std::vector<grpc::ByteBuffer> requests_;
  std::size_t next_ = 0;
  bool half_closes_;
  grpc::ByteBuffer answer_;
  Going& going_;
};

grpc::ByteBuffer Bytes(const std::string& prefixed) {
  const grpc::Slice slice(prefixed.substr(5));
  return grpc::ByteBuffer(&slice, 1);
}

}  // namespace

void CallByClient(const Access& access, const CallMessages& messages, std::uint64_t seed,
                  CallCounts& counts) {
  static constexpr std::array kMethods = {kReconstruct, kReconstruct,   kReconstructFrame,
                                          kWatchStream, kGetServerInfo, kHealthWatch};
  support::Random random(seed);
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 100);
  const auto credentials = access.authority.empty()
                               ? grpc::InsecureChannelCredentials()
                               : grpc::SslCredentials({.pem_root_certs = access.authority});
  Stub stub(grpc::CreateCustomChannel(access.address, credentials, arguments));
  Going going;
  while (!counts.stop && counts.left-- > 0) {
    const char* method = kMethods[random.Below(kMethods.size())];
    const auto one_of = [&](const std::vector<std::string>& from) {
      return Bytes(from[random.Below(from.size())]);
    };
    std::vector<grpc::ByteBuffer> requests;
    if (method == kReconstruct) {
      // Usually a stream that is opened and sends frames in order.
      if (random.Chance(0.8)) requests.push_back(Bytes(messages.opens[random.Below(8)]));
      for (std::size_t k = 0, frames = random.Below(6); k < frames; ++k) {
        requests.push_back(random.Chance(0.8) ? Bytes(messages.frames[k])
                                              : one_of(messages.frames));
      }
    } else if (method == kWatchStream) {
      requests.push_back(one_of(messages.watches));
      if (random.Chance(0.5)) requests.push_back(one_of(messages.credits));
    } else if (random.Chance(0.9)) {
      requests.push_back(one_of(messages.unary));
    }
    const microseconds deadline(random.Chance(0.3) ? random.Below(3'000) : 300'000);
    going.Enter();
    auto* call = new RandomCall(stub, method, std::move(requests), random.Chance(0.5), deadline,
                                access.token, going);
    call->Start();
    ++counts.client;
    if (random.Chance(0.5)) std::this_thread::sleep_for(microseconds(random.Below(1'200)));
    call->Leave(random.Chance(0.8));
  }
  going.WaitForNone();
}

Storm::Storm(std::string address, std::int64_t calls, std::uint64_t seed)
    : address_(std::move(address)) {
  counts_.left = calls;
  for (std::uint64_t k = 0; k < 3; ++k) {
    callers_.emplace_back(
        [this, seed = 16 * seed + k] { CallRaw(address_, messages_, seed, counts_); });
  }
  for (std::uint64_t k = 3; k < 5; ++k) {
    callers_.emplace_back(
        [this, seed = 16 * seed + k] { CallByClient({address_}, messages_, seed, counts_); });
  }
}

Storm::~Storm() { Stop(); }

void Storm::Wait() {
  for (std::thread& caller : callers_) {
    if (caller.joinable()) caller.join();
  }
}

void Storm::Stop() {
  counts_.stop = true;
  Wait();
}

}  // namespace partiemc::attack
