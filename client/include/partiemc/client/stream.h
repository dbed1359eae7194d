// A producer's stream to a PartiEMC server.
//
//   auto stream = partiemc::client::Stream::Open("127.0.0.1:50051",
//                                                {.parameters = {.spacing = 0.01}});
//   if (!stream.ok()) ...
//   std::thread receiver([&] {
//     partiemc::client::Event event;
//     for (auto got = (*stream)->Receive(event);
//          got.ok() && *got == partiemc::client::Received::kEvent;
//          got = (*stream)->Receive(event)) Draw(event);
//   });
//   for (...) (*stream)->Send({.positions = std::span<const float>(xy)}, time);
//   (*stream)->FinishSending();
//   receiver.join();
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partiemc/client/credentials.h"
#include "partiemc/client/frame_stream.h"

namespace partiemc::client {

/// What the server sends back for each frame; rings and statistics always come.
struct Outputs {
  bool mesh = true;
  bool normals = false;  ///< Outward unit normals at the points of the rings.
  /// Coordinates as float32 relative to an origin: half the bytes. A frame so wide that a point
  /// would move by more than 1e-4 spacings is refused.
  bool relative_float32 = false;
  bool echo_particles = false;  ///< Watchers of the stream get the particles too.
  /// Of Frame::attributes those that are wanted at the vertices (Result::attributes), at most 16;
  /// "velocity" are Frame::velocities. A frame that lacks one is refused.
  std::vector<std::string> attributes = {};
};

/// Patience of a producer that waits for its server, and of one that skips frames meanwhile or
/// watches.
inline constexpr std::chrono::minutes kPatience{5};
inline constexpr std::chrono::seconds kShortPatience{30};

/// How a stream goes on after its connection or its server was lost.
struct ReconnectPolicy {
  /// Time from the loss to the next new answer, after which the stream ends with an error. A lost
  /// connection is noticed within 10 s. 0: the stream ends with its connection.
  std::chrono::milliseconds give_up_after{kPatience};
  /// Each address is tried once at once. Then pauses follow, each twice as long as the one before,
  /// of which a random part is left out, so that many clients do not come back as one.
  std::chrono::milliseconds first_pause{50};
  std::chrono::milliseconds longest_pause{1000};
  /// Whether Receive tells of each reconnection (Event::Kind::kReconnected).
  bool announce = false;
};

/// Frames that come in parts, each from a process of its own: every rank of a simulator opens the
/// stream of the same name, sends its particles of each step, all ranks as many frames and in the
/// same order, also where it has none, and receives. Rank 0 gets the results, the others
/// Event::Kind::kPartTaken for what they have sent. A frame is that of all its particles, in the
/// order of their ids where they have ids, else part by part. Not for a LatestSender: ranks would
/// leave out different frames.
struct FrameParts {
  std::uint32_t parts = 0;  ///< 0: frames come whole.
  std::uint32_t part = 0;   ///< Below `parts`. Part 0 opens the stream; others wait for that.
  /// The same for all parts and for nobody else, at most 128 bytes of printable ASCII. Empty:
  /// whoever may produce a stream of this name may send its parts.
  std::string token = {};
  /// A frame that lacks a part for so long after part 0 has come is refused (PARTS_MISSING). Below
  /// `deadline`, at most ten minutes; part 0 decides.
  std::chrono::milliseconds timeout{10000};
};

struct StreamOptions {
  /// 1 to 128 characters of [A-Za-z0-9._-], unique on the server. Empty: the server makes one up.
  std::string name = {};
  ReconstructionParameters parameters = {};
  Outputs outputs = {};
  /// Shown where streams are listed. At most 16; 128 bytes at most, no control characters each.
  std::map<std::string, std::string> labels = {};
  /// TLS, certificates and token. Loopback and Unix sockets need none, unless the server wants
  /// them.
  Credentials credentials = {};
  /// For reaching the server; a server that starts meanwhile is found.
  std::chrono::milliseconds connect_timeout{2000};
  /// For the server to accept the stream, and then for each answer, counted from the frame, the
  /// answer or the reconnection before it, whichever came last.
  std::chrono::milliseconds deadline{30000};
  /// For Send to get a place in the window, whatever becomes of connection and server. A frame that
  /// gets none is refused (SEND_TIMEOUT, DEADLINE_EXCEEDED), and the stream goes on. Absent: as
  /// long as the stream lives, that is for `deadline`, after a loss for `reconnect.give_up_after`
  /// more.
  std::optional<std::chrono::milliseconds> send_timeout = {};
  /// Servers to go on with, beside the one that Open is given: of the same version and with no
  /// smaller limits. Behind a proxy one address is enough.
  std::vector<std::string> fallback_addresses = {};
  /// The server sends what is needed to go on elsewhere with every such frame. Less repeats fewer
  /// frames after a loss and holds fewer; it costs the bytes of the outline. 0: the stream ends
  /// with its connection.
  std::uint32_t checkpoint_interval = 4;
  ReconnectPolicy reconnect = {};
  /// Wants a name. What else is set here counts for part 0 alone, but for credentials, addresses
  /// and times.
  FrameParts parts = {};
  /// What frames may take that are held for being sent again: `checkpoint_interval` and a window of
  /// them. A frame that does not fit is refused.
  std::uint64_t max_held_bytes = std::uint64_t{1} << 30;
};

/// Frames are never dropped: Send waits while the server's window is full. A frame larger than the
/// server's limits is refused before anything is sent. Reading runs in the background, so that a
/// sender and a receiver never wait for each other beyond the window.
///
/// A stream survives its connection and its server: Receive connects again, to the next address
/// first, and goes on from the last checkpoint. Every frame is still answered once, in order, with
/// the bits that it would have had. Send does not fail meanwhile; it waits for the window, for
/// `send_timeout` at most.
class Stream : public FrameStream {
 public:
  /// `address` is HOST:PORT, [IPV6]:PORT or unix:PATH.
  /// Errors: INVALID_ARGUMENT (address, credentials, parameters, name or labels), UNAVAILABLE (no
  /// server at any address, or one of the two does not trust the other), UNAUTHENTICATED (token),
  /// RESOURCE_EXHAUSTED (no room for another stream), DEADLINE_EXCEEDED, each in one line.
  static absl::StatusOr<std::unique_ptr<Stream>> Open(std::string_view address,
                                                      const StreamOptions& options);

  /// Cancels the stream unless its end has been received. No call may be under way.
  ~Stream() override = default;
};

}  // namespace partiemc::client
