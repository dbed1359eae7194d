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

/// How the server sends coordinates.
enum class Coordinates : std::uint8_t {
  kFloat64,  ///< Exact: the same bits as in process.
  /// float32 relative to an origin: half the bytes. A frame is refused if it is so wide that a
  /// vertex would move by more than 1e-4 spacings.
  kRelativeFloat32,
  /// Surfaces are compressed to about 5 bytes per triangle, with normals: coordinates move by at
  /// most 0.0009 spacings, normals by 1.2 degrees, and triangles may touch where they nearly did.
  /// Points and triangles have another order within their shell. Rings and meshes as
  /// `kRelativeFloat32`.
  kCompact,
};

/// Outputs of each frame. Rings, surface and statistics are always included.
struct Outputs {
  bool mesh = true;
  bool normals = false;  ///< Outward unit normals at ring vertices. Surfaces always have them.
  Coordinates coordinates = Coordinates::kFloat64;
  bool echo_particles = false;  ///< Sends the particles to the stream's watchers too.
  /// Names of attributes to interpolate to the vertices (Result::attributes), at most 16.
  /// "velocity" means Frame::velocities. A frame with particles that lacks one of these attributes
  /// is refused.
  std::vector<std::string> attributes = {};
};

/// Default times before a client gives up reconnecting: kPatience for producers, kShortPatience for
/// watchers and for producers that skip frames.
inline constexpr std::chrono::minutes kPatience{5};
inline constexpr std::chrono::seconds kShortPatience{30};

/// How a stream reconnects after it lost its connection or its server.
struct ReconnectPolicy {
  /// Maximum time to reconnect, after which the stream ends with an error. The time starts when the
  /// loss is detected, which takes at most 10 s. Further losses before the next new result do not
  /// restart the time. 0: do not reconnect.
  std::chrono::milliseconds give_up_after{kPatience};
  /// Each address is first tried once without a pause. Then a pause precedes each round over the
  /// addresses: `first_pause`, doubled in each round up to `longest_pause`. Up to half of each
  /// pause is removed at random, so that many clients do not reconnect at the same moment.
  std::chrono::milliseconds first_pause{50};
  std::chrono::milliseconds longest_pause{1000};
  /// If set, Receive reports each reconnection (Event::Kind::kReconnected).
  bool announce = false;
};

/// Settings for frames that several processes (ranks) of a simulator send in parts. Every rank
/// opens a stream with the same name and sends its particles of every step, even if it has none.
/// All ranks send the same number of frames in the same order. Rank 0 receives the results, the
/// others Event::Kind::kPartTaken for each part. Particles are ordered by id if they have ids,
/// otherwise by part. Not for a LatestSender: ranks would skip different frames.
struct FrameParts {
  std::uint32_t parts = 0;  ///< Number of parts; 0: frames are sent whole.
  /// Below `parts`. Part 0 opens the stream; the other parts wait for it.
  std::uint32_t part = 0;
  /// Secret shared by all parts, at most 128 bytes of printable ASCII. Empty: any caller that may
  /// produce a stream of this name may send its parts.
  std::string token = {};
  /// Time limit for all parts of a frame, from the arrival of the first part. If a part is missing
  /// after this time, the server refuses the frame (PARTS_MISSING). 1 ms to ten minutes, at most
  /// `deadline`. The value of part 0 applies to all parts.
  std::chrono::milliseconds timeout{10000};
};

struct StreamOptions {
  /// 1 to 128 characters of [A-Za-z0-9._-], unique on the server. Empty: the server chooses a name.
  std::string name = {};
  ReconstructionParameters parameters = {};
  Outputs outputs = {};
  /// Shown in lists of streams. At most 16; keys and values have at most 128 bytes and no control
  /// characters.
  std::map<std::string, std::string> labels = {};
  /// TLS, certificates and token. Loopback and Unix sockets need none unless the server requires
  /// them.
  Credentials credentials = {};
  /// Maximum time to reach the server. It includes the wait for a server that is still starting.
  std::chrono::milliseconds connect_timeout{2000};
  /// Maximum time for the server to accept the stream, and for each response. The time starts at
  /// the latest of three events: the frame was sent, the previous response, a reconnection.
  std::chrono::milliseconds deadline{30000};
  /// Maximum time that Send waits for a slot in the window, even while the connection is lost. A
  /// frame that gets no slot is refused (SEND_TIMEOUT, DEADLINE_EXCEEDED), and the stream
  /// continues. Set or not, Send waits at most `deadline`, while the connection is lost
  /// `reconnect.give_up_after` longer; then the stream ends.
  std::optional<std::chrono::milliseconds> send_timeout = {};
  /// Servers to fail over to, in addition to the address of Open. Their version must be the same,
  /// their limits at least as large. Behind a proxy one address is enough.
  std::vector<std::string> fallback_addresses = {};
  /// Number of frames between checkpoints. A smaller number means fewer frames to hold and to
  /// resend after a loss, but more traffic: each checkpoint has the size of the outline. 0: do not
  /// reconnect.
  std::uint32_t checkpoint_interval = 4;
  ReconnectPolicy reconnect = {};
  /// Settings for frames in parts; they require a name. Each part sets its own credentials,
  /// addresses and times. The server reads parameters, outputs, labels and `checkpoint_interval`
  /// from part 0 only.
  FrameParts parts = {};
  /// Maximum total bytes of the frames held for resending (up to `checkpoint_interval` frames plus
  /// the window). Send waits until responses free memory. A frame that does not fit after all
  /// earlier frames are answered is refused (HELD_BYTES).
  std::uint64_t max_held_bytes = std::uint64_t{1} << 30;
};

/// Never drops frames: Send waits while the server's window is full. A frame with more particles or
/// bytes than the server allows is refused before anything is sent. Responses are read in the
/// background, so the sender waits for the receiver only while the window is full.
///
/// Survives the loss of its connection and its server: Receive reconnects, beginning with the next
/// address, and resumes from the last checkpoint. Every frame is still answered once, in order,
/// with the same bits. Send does not fail while the stream reconnects; it waits for the window, at
/// most `send_timeout`.
class Stream : public FrameStream {
 public:
  /// `address` is HOST:PORT, [IPV6]:PORT or unix:PATH. Errors: INVALID_ARGUMENT (address,
  /// credentials, parameters, name or labels), UNAVAILABLE (no server at any address, or TLS
  /// verification failed), UNAUTHENTICATED (token), RESOURCE_EXHAUSTED (no slot for another
  /// stream), UNIMPLEMENTED (the server is too old for a parameter), DEADLINE_EXCEEDED. Each
  /// message is one line.
  static absl::StatusOr<std::unique_ptr<Stream>> Open(std::string_view address,
                                                      const StreamOptions& options);

  /// Cancels the stream unless its end has been received. No call may be in progress.
  ~Stream() override = default;
};

}  // namespace partiemc::client
