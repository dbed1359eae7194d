#include "server/relay/stream_summary.h"

#include <algorithm>

#include "wire/codec.h"

namespace partiemc::server {

void EncodeSummary(const StreamSummary& stream, std::chrono::steady_clock::time_point now,
                   v1::StreamSummary& message) {
  const auto seconds_since = [now](std::chrono::steady_clock::time_point then) {
    return std::chrono::duration<double>(now - then).count();
  };
  message.set_stream_id(stream.id);
  message.set_stream_name(stream.description.name);
  message.mutable_labels()->insert(stream.description.labels.begin(),
                                   stream.description.labels.end());
  wire::EncodeParameters(stream.description.parameters, *message.mutable_parameters());
  message.set_last_sequence(stream.counts.last_sequence);
  message.set_frames(stream.counts.frames);
  message.set_frame_errors(stream.counts.frame_errors);
  message.set_watchers(stream.description.broadcaster->watcher_count());
  message.set_open_seconds(seconds_since(stream.opened));
  message.set_idle_seconds(std::max(0.0, seconds_since(stream.counts.last_activity)));
}

}  // namespace partiemc::server
