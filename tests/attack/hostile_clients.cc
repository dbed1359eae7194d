#include "attack/hostile_clients.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "attack/floods.h"
#include "attack/http2_client.h"
#include "attack/processor_share.h"
#include "attack/requests.h"
#include "attack/sender.h"

namespace partiemc::attack {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kAttackPatience(3'000);
// Pause between two rounds of an attacker, because several share two cores with the server.
constexpr milliseconds kPause(300);
constexpr std::size_t kMegabyte = 1'000'000, kMebibyte = 1 << 20;

using Client = std::unique_ptr<Http2Client>;

Headers Bearer(const Hostility& hostility) {
  return {{"authorization", "Bearer " + hostility.token}};
}

// Runs rounds with one connection each. A round's connection stays open for `kept` more rounds.
void Rounds(Hostility& hostility, std::size_t kept, const std::function<void(Http2Client&)>& round,
            const Http2Client::Options& options = {}) {
  std::deque<Client> open;
  while (!hostility.stop) {
    try {
      open.push_back(std::make_unique<Http2Client>(hostility.address, options));
      round(*open.back());
      ++hostility.rounds;
    } catch (const std::runtime_error&) {
      // Without a connection, the test checks whether the server lives.
    }
    while (open.size() > kept) open.pop_front();
    std::this_thread::sleep_for(kPause);
  }
}

// Opens a stream and waits until it is open or refused.
std::uint32_t OpenStream(Http2Client& client, const Hostility& hostility,
                         const std::string& open = Open().SerializeAsString()) {
  const auto call = client.Call(CallHeaders(kReconstruct, Bearer(hostility)));
  bool answered = false;
  client.OnFrame([&](const ReceivedFrame& frame) {
    answered |=
        frame.stream == call && (frame.type == FrameType::kData || frame.type == FrameType::kReset);
  });
  client.SendData(call, Prefixed(open), false, kAttackPatience);
  client.Read(kAttackPatience, [&] { return answered; });
  client.OnFrame(nullptr);
  return call;
}

// A frame of a few particles with additional fields.
std::string FrameWith(std::uint64_t sequence, std::string_view more) {
  std::string frame = Blob(sequence, 1, 60).frame().SerializeAsString();
  return Prefixed(InField(2, frame.append(more)));
}

void UnknownFields(Hostility& hostility) {
  const std::string unknown = UnknownField(1000, 5 * kMebibyte);
  Rounds(hostility, 0, [&](Http2Client& client) {
    const auto call = OpenStream(client, hostility);
    for (std::uint64_t sequence = 1; sequence <= 60 && !hostility.stop; ++sequence) {
      // Inside or beside the frame: a reused request must keep neither.
      const std::string frame = Blob(sequence, 1, 60).frame().SerializeAsString();
      const std::string message =
          sequence % 2 == 0 ? InField(2, frame + unknown) : InField(2, frame) + unknown;
      if (!client.SendData(call, Prefixed(message), false, kAttackPatience)) break;
    }
  });
}

void RepeatedFields(Hostility& hostility) {
  std::string scalars;
  for (std::size_t k = 0; k < 5 * kMegabyte; ++k) scalars += std::string_view("\x42\0", 2);
  const std::string frame = FrameWith(1, scalars);
  Rounds(hostility, 0, [&](Http2Client& client) {
    std::vector<std::uint32_t> calls;
    for (int k = 0; k < 8; ++k) calls.push_back(OpenStream(client, hostility));
    for (const auto call : calls) {
      if (!client.SendData(call, frame, false, kAttackPatience)) break;
    }
    client.Read(kAttackPatience);
  });
}

void HugeOpens(Hostility& hostility) {
  auto labelled = Open();
  for (std::size_t k = 0; k < 9'900'000 / 24; ++k) {
    (*labelled.mutable_open()->mutable_labels())["label-" + std::to_string(k)] = "12345678";
  }
  auto resumed = Open();
  resumed.mutable_open()->mutable_resume()->set_stream_token(std::string(32, 'a'));
  resumed.mutable_open()->mutable_resume()->set_checkpoint(std::string(76 * kMebibyte, 'x'));
  const std::array opens = {Prefixed(labelled.SerializeAsString()),
                            Prefixed(resumed.SerializeAsString())};
  Rounds(hostility, 0, [&](Http2Client& client) {
    for (const std::string& open : opens) {
      const auto call = client.Call(CallHeaders(kReconstruct, Bearer(hostility)));
      if (!client.SendData(call, open, false, kAttackPatience)) return;
    }
    client.Read(kAttackPatience);
  });
}

void UnreadAnswers(Hostility& hostility) {
  const std::string request = Prefixed(LoneParticles(20'000).SerializeAsString());
  Rounds(hostility, 8,
         [&](Http2Client& client) {
           for (int k = 0; k < 16 && !hostility.stop; ++k) {
             const auto call = client.Call(CallHeaders(kReconstructFrame, Bearer(hostility)));
             if (!client.SendData(call, request, true, kAttackPatience)) return;
           }
           client.Read(milliseconds(500));
         },
         {.stream_window = 0});
}

void UnfinishedCalls(Hostility& hostility) {
  const std::string part(2 * kMegabyte, 'x');
  Rounds(hostility, 12, [&](Http2Client& client) {
    for (int k = 0; k < 6 && !hostility.stop; ++k) {
      const auto call = client.Call(
          CallHeaders(k % 2 == 0 ? kReconstruct : kReconstructFrame, Bearer(hostility)));
      client.Data(call, MessagePrefix(100 * kMegabyte));
      // Sends as much as the server allows, then nothing.
      client.SendData(call, part, false, milliseconds(300));
    }
    // Also endless headers.
    client.CallBlock(HeaderBlock(CallHeaders(kReconstruct, Bearer(hostility))), 0);
    client.Flush(kAttackPatience);
  });
}

void CallersWithoutToken(Hostility& hostility) {
  const std::string body = Prefixed(std::string(20 * kMegabyte, 'x'));
  Rounds(hostility, 4, [&](Http2Client& client) {
    for (const char* method : {kReconstruct, kReconstructFrame, kWatchStream, kListStreams}) {
      const auto call = client.Call(CallHeaders(method));
      client.SendData(call, body, false, milliseconds(500));
    }
    for (int k = 0; k < 100; ++k) {
      client.Data(client.Call(CallHeaders(k % 2 == 0 ? kHealthCheck : kGetServerInfo)),
                  Prefixed(""), true);
    }
    client.Flush(kAttackPatience);
    client.Read(milliseconds(100));
  });
}

void BadFrames(Hostility& hostility) {
  std::vector<std::string> bad;
  auto frame = Blob(1, 1, 60);
  frame.mutable_frame()->mutable_positions()->append("x");
  bad.push_back(Prefixed(frame.SerializeAsString()));
  bad.push_back(Prefixed(Blob(1'000'000, 1, 60).SerializeAsString()));
  bad.push_back(Prefixed(InField(2, "\xff\xff")));
  frame = Blob(1, 1, 60);
  frame.mutable_frame()->set_volumes("1234");
  bad.push_back(Prefixed(frame.SerializeAsString()));
  Rounds(hostility, 0, [&](Http2Client& client) {
    const auto call = OpenStream(client, hostility);
    for (std::uint64_t sequence = 1; sequence <= 200 && !hostility.stop; ++sequence) {
      const std::string& message = hostility.random.Chance(0.2)
                                       ? bad[hostility.random.Below(bad.size())]
                                       : Prefixed(Blob(sequence, 1, 1'000).SerializeAsString());
      if (!client.SendData(call, message, false, kAttackPatience)) break;
    }
    client.Data(call, "", true);
    client.Flush(kAttackPatience);
    client.Read(milliseconds(500));
  });
}

void KilledClients(Hostility& hostility) {
  Rounds(hostility, 0, [&](Http2Client& client) {
    for (int k = 0; k < 4; ++k) {
      const auto call = OpenStream(client, hostility);
      for (std::uint64_t sequence = 1; sequence <= 8; ++sequence) {
        client.SendData(call, Prefixed(Blob(sequence, 1, 1'000).SerializeAsString()), false,
                        milliseconds(100));
      }
    }
    // The state of a client after kill -9: a cut connection.
    client.Close(/*reset=*/hostility.random.Chance(0.5));
  });
}

void CallsThatStay(Hostility& hostility) {
  Rounds(hostility, 20, [&](Http2Client& client) {
    static constexpr std::array kMethods = {kHealthWatch, kReconstruct, kWatchStream, kHealthCheck,
                                            kReconstructFrame};
    for (std::size_t k = 0; k < 200; ++k) {
      client.Call(
          CallHeaders(kMethods[k % kMethods.size()], k % 2 == 0 ? Headers{} : Bearer(hostility)));
    }
    client.Flush(kAttackPatience);
    client.Read(milliseconds(100));
  });
}

// Runs `work` for each number below `count`, all at the same time.
void AllAtOnce(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < count; ++k) {
    threads.emplace_back([&work, k] {
      YieldProcessors();
      try {
        work(k);
      } catch (const std::runtime_error&) {
        // As in Rounds.
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// Frames of the maximum size, in more streams than there is memory for.
void SendLargeFrames(Hostility& hostility) {
  const std::string frame = SquareFrame(1, 400, kLarge);
  while (!hostility.stop) {
    AllAtOnce(31, [&](std::size_t) {
      Sender sender(hostility.address, hostility.token);
      if (sender.Open() && sender.Send(frame, true, kAttackPatience))
        sender.IsAnswered(kAttackPatience);
    });
    ++hostility.rounds;
  }
}

// Parts of frames of the maximum size, in streams whose part 0 sends nothing.
void PartsWithoutPart0(Hostility& hostility) {
  constexpr std::size_t kStreams = 6, kParts = 5;
  const std::string frame = SquareFrame(1, 400, kLarge);
  while (!hostility.stop) {
    const std::string round = std::to_string(hostility.rounds) + "-";
    std::vector<std::unique_ptr<Sender>> leaders;
    AllAtOnce(1, [&](std::size_t) {
      for (std::size_t stream = 0; stream < kStreams; ++stream) {
        leaders.push_back(std::make_unique<Sender>(hostility.address, hostility.token));
        leaders.back()->Open({"parts-" + round + std::to_string(stream), 0, kParts, 2'000});
      }
    });
    AllAtOnce(kStreams * (kParts - 1), [&](std::size_t k) {
      Sender sender(hostility.address, hostility.token);
      const auto part = static_cast<std::uint32_t>(1 + k % (kParts - 1));
      if (!sender.Open({"parts-" + round + std::to_string(k / (kParts - 1)), part, kParts})) return;
      if (sender.Send(frame, false, kAttackPatience)) sender.IsAnswered(kAttackPatience);
    });
    ++hostility.rounds;
  }
}

// Every flood below the level of calls, one second each, each from another address.
void EveryFlood(Hostility& hostility) {
  for (std::uint64_t k = 0; !hostility.stop; ++k) {
    const Flood& flood = Floods()[k % Floods().size()];
    RunFlood(flood, {.address = hostility.address,
                     .source = "127.0.0." + std::to_string(2 + k % 200),
                     .time = milliseconds(1'000),
                     .yield_processors = true});
    ++hostility.rounds;
  }
}

// Handshakes of WebSocket calls that send no request.
void MuteHandshakes(Hostility& hostility) {
  const auto colon = hostility.web.rfind(':');
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(hostility.web.substr(colon + 1))));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string request =
      "GET /v1/watch HTTP/1.1\r\nHost: " + hostility.web + "\r\nOrigin: http://" + hostility.web +
      "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nAuthorization: Bearer " +
      hostility.token + "\r\n\r\n";
  std::deque<int> open;
  while (!hostility.stop) {
    for (int k = 0; k < 256; ++k) {
      const int file = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      if (::connect(file, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0) {
        [[maybe_unused]] const auto sent =
            ::send(file, request.data(), request.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      }
      open.push_back(file);
    }
    ++hostility.rounds;
    std::this_thread::sleep_for(kPause);
    for (; open.size() > 300; open.pop_front()) ::close(open.front());
  }
  for (const int file : open) ::close(file);
}

constexpr std::array kAttacks = {
    Attack{"unknown-fields", "60 frames with 5 MiB of an unknown field each", UnknownFields},
    Attack{"repeated-fields", "8 frames with 10 MB of empty scalars each", RepeatedFields},
    Attack{"huge-opens", "9.9 MB of labels; a checkpoint of 76 MiB", HugeOpens},
    Attack{"unread-answers", "unary answers that nobody reads", UnreadAnswers},
    Attack{"unfinished-calls", "bodies that are begun and never finished", UnfinishedCalls},
    Attack{"without-token", "20 MB bodies and calls without a token", CallersWithoutToken},
    Attack{"bad-frames", "every fifth frame breaks a rule", BadFrames},
    Attack{"killed-clients", "connections cut with frames in flight", KilledClients},
    Attack{"calls-that-stay", "hundreds of calls that say nothing", CallsThatStay},
    Attack{"large-frames", "31 streams with a frame of 32.9 MB each", SendLargeFrames},
    Attack{"parts-without-part-0", "24 parts of 32.9 MB, and part 0 is silent", PartsWithoutPart0},
    Attack{"every-flood", "each flood of tests/attack/floods.h for a second", EveryFlood},
    Attack{"mute-handshakes", "256 WebSocket calls without a request", MuteHandshakes},
};

}  // namespace

std::span<const Attack> Attacks() { return kAttacks; }

void FloodWithoutToken(Hostility& hostility, std::uint64_t calls, std::size_t connections) {
  static constexpr std::array kMethods = {kReconstruct, kReconstructFrame, kWatchStream,
                                          kListStreams, kGetServerInfo,    kHealthCheck,
                                          kHealthWatch, kReflection};
  const std::string body = Prefixed(std::string(20 * kMegabyte, 'x'));
  std::vector<Client> clients(connections);
  const auto began = std::chrono::steady_clock::now();
  for (std::uint64_t begun = 0; !hostility.stop; ++begun) {
    std::this_thread::sleep_until(began + begun * std::chrono::microseconds(60'000'000) / calls);
    Client& client = clients[begun % connections];
    try {
      if (!client || client->closed()) client = std::make_unique<Http2Client>(hostility.address);
    } catch (const std::runtime_error&) {
      continue;
    }
    const auto call = client->Call(CallHeaders(kMethods[hostility.random.Below(kMethods.size())]));
    switch (hostility.random.Below(4)) {
      case 0:
        break;  // Then stays silent.
      case 1:
        client->Data(call, Prefixed(""), true);
        break;
      case 2:
        client->Reset(call);
        break;
      default:
        client->Data(call, MessagePrefix(20 * kMegabyte));
        break;
    }
    if (begun % 500 == 0) {
      client->SendData(call, body, false, milliseconds(100));
    } else {
      client->Flush(milliseconds(100));
    }
    client->Read(milliseconds(0));
    ++hostility.rounds;
  }
}

}  // namespace partiemc::attack
