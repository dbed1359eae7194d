// usage: lammps_column SCRIPT ADDRESS EVERY STEPS
//
// A collapsing column of grains (lammps_column.in), computed by LAMMPS as a library and streamed
// during the run. An example for a C++ simulator that links LAMMPS or has its own solver. Under
// mpirun each process sends its own grains.
#include <lammps/library.h>

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "partiemc/client/stream.h"

namespace {

namespace client = partiemc::client;

struct Live {
  void* simulation = nullptr;
  client::Stream* stream = nullptr;
  double step_length = 0;
  absl::Status status = absl::OkStatus();
};

// Callback of `fix external`: `positions[0]` points to the coordinates of `count` particles, x, y,
// z, x, y, z, ... The stream copies each number once.
void Send(void* context, std::int64_t step, int count, int* ids, double** positions, double**) {
  Live& live = *static_cast<Live*>(context);
  if (!live.status.ok()) return;
  constexpr std::ptrdiff_t kStride = 3 * sizeof(double);
  client::ParticleArrays particles{.count = static_cast<std::size_t>(count)};
  if (count > 0) {
    auto** const v = static_cast<double**>(lammps_extract_atom(live.simulation, "v"));
    particles.x = {positions[0], kStride};
    particles.y = {positions[0] + 1, kStride};
    particles.ids = {ids};
    particles.velocity_x = {v[0], kStride};
    particles.velocity_y = {v[0] + 1, kStride};
  }
  live.status =
      live.stream->SendArrays(particles, static_cast<double>(step) * live.step_length).status();
}

// Receives until the end of the stream, on its own thread, because the simulation does not wait.
absl::Status Receive(client::Stream& stream) {
  client::Event event;
  for (;;) {
    const auto received = stream.Receive(event);
    if (!received.ok()) return received.status();
    if (*received == client::Received::kEnd) return absl::OkStatus();
    if (event.kind == client::Event::Kind::kPartTaken) continue;  // Process 0 receives the results.
    if (event.kind != client::Event::Kind::kResult) {
      std::fprintf(stderr, "%s\n", event.message.c_str());
      continue;
    }
    std::printf("t = %.17g: %zu rings, area %.17g, %016" PRIx64 " %016" PRIx64 "\n", event.time,
                event.frame.result.rings.RingCount(), event.frame.result.statistics.area,
                event.frame.rings_digest, event.frame.mesh_digest);
    std::fflush(stdout);
  }
}

int Fail(const absl::Status& status) {
  std::fprintf(stderr, "lammps_column: %s\n", status.ToString().c_str());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::string script = argv[1], address = argv[2], every = argv[3], steps = argv[4];
  const char* arguments[] = {"lammps", "-log", "none", "-screen", "none", "-var", "every", argv[3]};
  void* const simulation = lammps_open_no_mpi(8, const_cast<char**>(arguments), nullptr);
  lammps_file(simulation, script.c_str());

  const int ranks = lammps_extract_setting(simulation, "world_size");
  const int rank = lammps_extract_setting(simulation, "world_rank");
  client::FrameParts parts;
  if (ranks > 1) {
    parts = {.parts = static_cast<std::uint32_t>(ranks), .part = static_cast<std::uint32_t>(rank)};
  }
  auto stream = client::Stream::Open(address, {.name = "column",
                                               .parameters = {.spacing = 1.0},
                                               .outputs = {.echo_particles = true},
                                               .parts = parts});
  if (!stream.ok()) return Fail(stream.status());
  Live live{.simulation = simulation, .stream = stream->get()};
  live.step_length = *static_cast<double*>(lammps_extract_global(simulation, "dt"));
  absl::Status received;
  std::thread receiver([&] { received = Receive(**stream); });
  lammps_set_fix_external_callback(simulation, "live", Send, &live);
  lammps_command(simulation, ("run " + steps).c_str());
  if (live.status.ok()) live.status = (*stream)->FinishSending();
  if (!live.status.ok()) (*stream)->Cancel();
  receiver.join();
  lammps_close(simulation);
  lammps_mpi_finalize();
  if (!live.status.ok()) return Fail(live.status);
  return received.ok() ? 0 : Fail(received);
}
