#include "server/compute/busy_streams.h"

#include <algorithm>
#include <bit>

namespace partiemc::server {

void BusyStreams::Worked(Mark& stream, std::size_t size, Clock::time_point now) {
  if (const std::int64_t period = Period(now); period != period_) {
    for (SizeClass& c : classes_) {
      c.streams_before = period == period_ + 1 ? c.streams : 0;
      c.streams = 0;
    }
    period_ = period;
  }
  const auto size_class = static_cast<std::size_t>(std::bit_width(size));
  classes_[size_class].last = now;
  // Each stream counts once in a period, in the size class of its largest frame.
  if (stream.period_ == period_) {
    if (size_class <= stream.size_class_) return;
    --classes_[stream.size_class_].streams;
  }
  ++classes_[size_class].streams;
  stream.period_ = period_;
  stream.size_class_ = size_class;
}

std::size_t BusyStreams::Count(std::size_t size, Clock::time_point now) const {
  std::size_t streams = 0, streams_before = 0;
  bool late = false;
  for (auto k = static_cast<std::size_t>(std::bit_width(size)); k < classes_.size(); ++k) {
    streams += classes_[k].streams;
    streams_before += classes_[k].streams_before;
    late = late || now - classes_[k].last < late_;
  }
  // Uses the larger of both counts: early in a period only few streams have been counted yet.
  return late ? std::max(streams, streams_before) : 0;
}

}  // namespace partiemc::server
