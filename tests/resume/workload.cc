#include "resume/workload.h"

#include <limits>
#include <thread>
#include <utility>

#include "client/recording/recording.h"
#include "partiemc/client/local_stream.h"
#include "server/merging_balls.h"
#include "server/moving_blob.h"

namespace partiemc::resume {
namespace {

// Simulation time between frames, also where a sequence repeats.
constexpr double kTimeStep = 0.01;

void Receive(client::FrameStream& stream, History& history) {
  client::Event event;
  for (;;) {
    const auto received = stream.Receive(event);
    if (!received.ok()) history.end = received.status();
    if (!received.ok() || *received == client::Received::kEnd) return;
    if (event.kind == client::Event::Kind::kReconnected) {
      history.reconnections.push_back(Clock::now());
    }
    const bool is_refusal = event.kind == client::Event::Kind::kRefusal;
    if (event.kind != client::Event::Kind::kResult && !is_refusal) continue;
    Answer answer = AnswerOf(event);
    answer.at = Clock::now();
    history.answers.push_back(std::move(answer));
  }
}

}  // namespace

Answer AnswerOf(const client::Event& event) {
  if (event.kind != client::Event::Kind::kResult) return {.sequence = event.sequence};
  const client::FrameResult& frame = event.frame;
  Answer answer{.sequence = event.sequence,
                .is_result = true,
                .rings_digest = frame.rings_digest,
                .mesh_digest = frame.mesh_digest,
                .surface_digest = frame.surface_digest,
                .time = event.time};
  for (const auto& ring : frame.result.rings.measures) answer.identities.push_back(ring.identity);
  for (const auto& shell : frame.result.surface.measures) {
    answer.identities.push_back(shell.identity);
  }
  return answer;
}

Workload DamBreak() {
  const std::string path = PARTIEMC_SOURCE_DIR "/client/recordings/dam_break.pemc";
  const auto reader = client::RecordingReader::Open(path, "");
  EXPECT_TRUE(reader.ok()) << reader.status();
  Workload workload{.name = "dam-break"};
  workload.parameters.spacing = (*reader)->header().spacing;
  client::RecordedFrame frame;
  for (auto more = (*reader)->Next(frame); more.ok() && *more; more = (*reader)->Next(frame)) {
    workload.frames.push_back({.positions = frame.positions, .ids = frame.ids});
  }
  return workload;
}

Workload Blob() {
  Workload workload{.name = "blob"};
  workload.parameters.spacing = server::kBlobSpacing;
  for (std::uint64_t k = 0; k < 40; ++k) {
    workload.frames.push_back({.positions = server::MovingBlob(3, k)});
    if (k % 11 != 10) continue;
    workload.frames.back().positions[4] = std::numeric_limits<double>::quiet_NaN();
    workload.frames.back().is_bad = true;
  }
  return workload;
}

Workload Leap() {
  Workload workload{.name = "leap"};
  workload.parameters.spacing = 1;
  for (int k = 0; k < 30; ++k) {
    Workload::Particles frame;
    const auto add = [&](int x, int y, std::uint64_t id) {
      frame.positions.insert(frame.positions.end(), {1.0 * x, 1.0 * y});
      frame.ids.push_back(id);
    };
    for (int i = 0; i < 400; ++i) add(i % 40, i / 40, static_cast<std::uint64_t>(i));
    for (int i = 0; i < 16; ++i) {
      add(40 * k + i % 4, 20 + i / 4, 1000 + static_cast<std::uint64_t>(i));
    }
    workload.frames.push_back(std::move(frame));
  }
  return workload;
}

Workload Merge() {
  Workload workload{.name = "merge", .parameters = server::MergingBallsParameters()};
  workload.components = 3;
  for (std::uint64_t k = 0; k < 18; ++k) {
    server::SpaceParticles particles = server::MergingBalls(k);
    workload.frames.push_back(
        {.positions = std::move(particles.positions), .ids = std::move(particles.ids)});
  }
  return workload;
}

History RunThrough(client::FrameStream& stream, const Workload& workload, double per_second,
                   const std::function<bool(std::uint64_t)>& enough) {
  History history;
  std::thread receiver([&] { Receive(stream, history); });
  std::uint64_t sent = 0;
  std::size_t most_in_flight = 0;
  auto due = Clock::now();
  while (!enough(sent)) {
    if (per_second > 0) {
      std::this_thread::sleep_until(due);
      due = std::max(due, Clock::now() - std::chrono::milliseconds(100)) +
            std::chrono::duration_cast<Clock::duration>(
                std::chrono::duration<double>(1 / per_second));
    }
    const double time = kTimeStep * static_cast<double>(sent);
    const auto sequence = stream.Send(workload.FrameAt(sent, time), time);
    if (!sequence.ok()) break;  // The receiver gets the error, too.
    EXPECT_EQ(*sequence, sent + 1);
    ++sent;
    most_in_flight = std::max(most_in_flight, stream.InFlight());
  }
  stream.FinishSending().IgnoreError();
  receiver.join();
  history.sent = sent;
  history.most_in_flight = most_in_flight;
  return history;
}

History RunUndisturbed(const Workload& workload, std::uint64_t frames) {
  const auto stream = client::LocalStream::Open({.parameters = workload.parameters, .threads = 2});
  EXPECT_TRUE(stream.ok()) << stream.status();
  return RunThrough(**stream, workload, 0, [frames](std::uint64_t sent) { return sent >= frames; });
}

}  // namespace partiemc::resume
