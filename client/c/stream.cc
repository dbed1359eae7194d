#include "partiemc/client/stream.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/c/errors.h"
#include "client/c/particles.h"
#include "client/c/structs.h"
#include "client/library/adapters/seconds.h"
#include "partiemc/c/partiemc.h"
#include "partiemc/client/latest_sender.h"
#include "partiemc/client/local_stream.h"
#include "partiemc/client/parameter_names.h"
#include "partiemc/status.h"

using partiemc::client::Event;
using partiemc::client::FrameStream;
using partiemc::client::LatestSender;
using partiemc::client::LocalStream;
using partiemc::client::Received;
using partiemc::client::SetByName;
using partiemc::client::Stream;

struct partiemc_stream {
  std::unique_ptr<FrameStream> stream;
  std::unique_ptr<LatestSender> latest;  // Destroyed before the stream. Null without `latest`.
  bool shows_normals = false;
  Event event;
  std::vector<partiemc_values> values;                             // Attributes of the last event.
  partiemc_surface surface{};                                      // Surface of the last event.
  std::vector<std::vector<partiemc_values>> section_values;        // Attributes of each section.
  std::vector<partiemc::client::AttributeArrays> sent_attributes;  // Sender's thread only.
};

namespace partiemc::c {
namespace {

std::string Text(const char* text) { return text == nullptr ? "" : text; }

// Converts `seconds`; `otherwise` for 0 and NaN. Negative times become 0.
std::chrono::milliseconds Milliseconds(double seconds, std::chrono::milliseconds otherwise) {
  if (seconds == 0 || seconds != seconds) return otherwise;
  return client::ToMilliseconds(seconds);
}

// Refuses negative times, except for `give_up_after`, where they have a meaning.
absl::Status CheckTimes(const partiemc_options& options) {
  const std::pair<const char*, double> times[] = {{"connect_timeout", options.connect_timeout},
                                                  {"deadline", options.deadline},
                                                  {"send_timeout", options.send_timeout},
                                                  {"part_timeout", options.part_timeout}};
  for (const auto& [name, seconds] : times) {
    if (!(seconds < 0)) continue;
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {.reason = std::string(kReasonOutOfRange),
                           .field = name,
                           .value = absl::StrCat(seconds),
                           .rule = "must be 0 or more seconds"});
  }
  return absl::OkStatus();
}

// For options where 0 means the default: a negative number stands for the value 0.
template <typename T>
T ZeroIfNegative(T number) {
  return number < 0 ? T{0} : number;
}

// Reads six numbers; empty for a null pointer.
std::optional<SlicePlane> SliceOf(const double* numbers) {
  if (numbers == nullptr) return std::nullopt;
  SlicePlane slice;
  std::copy_n(numbers, 3, slice.origin.begin());
  std::copy_n(numbers + 3, 3, slice.normal.begin());
  return slice;
}

std::vector<Wall> WallsOf(const partiemc_options& options) {
  std::vector<Wall> walls(options.wall_count);
  const double* point = options.walls;
  for (std::size_t k = 0; k < walls.size(); ++k) {
    const std::size_t coordinates = 2 * std::size_t{options.wall_sizes[k]};
    walls[k].points.assign(point, point + coordinates);
    point += coordinates;
  }
  return walls;
}

// Checks that an array with a count above zero is given.
absl::Status CheckArrays(const partiemc_options& options) {
  struct Array {
    const char* name;
    const char* count_name;
    std::size_t count;
    const void* entries;
  };
  const Array arrays[] = {
      {"sections", "section_count", options.section_count, options.sections},
      {"phases", "phase_count", options.phase_count, options.phases},
      {"walls", "wall_count", options.wall_count, options.walls},
      {"wall_sizes", "wall_count", options.wall_count, options.wall_sizes},
      {"wall_phases", "wall_phase_count", options.wall_phase_count, options.wall_phases},
      {"wall_planes", "wall_plane_count", options.wall_plane_count, options.wall_planes}};
  for (const auto& [name, count_name, count, entries] : arrays) {
    if (count == 0 || entries != nullptr) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": NULL; must be an array of ", count_name, " entries"));
  }
  return absl::OkStatus();
}

absl::StatusOr<ReconstructionParameters> ParametersOf(const partiemc_options& options) {
  if (absl::Status status = CheckArrays(options); !status.ok()) return status;
  ReconstructionParameters parameters;
  if (options.spacing != 0) parameters.spacing = options.spacing;
  if (options.kernel_radius != 0) parameters.kernel_radius = options.kernel_radius;
  if (options.cell_size != 0) parameters.cell_size = options.cell_size;
  parameters.slice = SliceOf(options.slice);
  parameters.box = BoxOf(options.box);
  if (parameters.box) parameters.box->wraps = options.wrap != 0;
  if (options.isovalue != 0) parameters.isovalue = options.isovalue;
  if (options.attribute_tolerance != 0) {
    parameters.attribute_tolerance = options.attribute_tolerance;
  }
  SurfaceOptions& surface = parameters.surface;
  if (options.thinning_distance != 0) {
    surface.thinning_distance = ZeroIfNegative(options.thinning_distance);
  }
  if (options.max_drop_particles != 0) {
    surface.max_drop_particles =
        static_cast<std::uint64_t>(ZeroIfNegative(options.max_drop_particles));
  }
  surface.simplify = options.simplify;
  surface.min_component_volume = options.min_component_volume;
  for (std::size_t k = 0; k < options.section_count; ++k) {
    const partiemc_section& from = options.sections[k];
    Section& section = parameters.sections.emplace_back();
    section.slice = SliceOf(from.slice);
    if (from.isovalue != 0) section.isovalue = from.isovalue;
  }
  for (std::size_t k = 0; k < options.phase_count; ++k) {
    parameters.sections.push_back({.phase = options.phases[k]});
  }
  if (options.phase_attribute != nullptr) parameters.phase_attribute = options.phase_attribute;
  parameters.walls = WallsOf(options);
  parameters.wall_phases.assign(options.wall_phases,
                                options.wall_phases + options.wall_phase_count);
  for (std::size_t k = 0; k < options.wall_plane_count; ++k) {
    const partiemc_wall_plane& from = options.wall_planes[k];
    parameters.wall_planes.push_back({from.axis, from.position, from.fluid_below == 0});
  }
  absl::Status named;
  if (options.output != nullptr) named.Update(SetByName(options.output, parameters.output));
  if (options.placement != nullptr)
    named.Update(SetByName(options.placement, parameters.placement));
  if (options.fill != nullptr) named.Update(SetByName(options.fill, parameters.fill));
  if (options.plane != nullptr) named.Update(SetByName(options.plane, parameters.plane));
  if (options.sizes != nullptr) named.Update(SetByName(options.sizes, parameters.sizes));
  if (options.boundary != nullptr) named.Update(SetByName(options.boundary, parameters.boundary));
  if (!named.ok()) return named;
  return parameters;
}

std::vector<std::string> NamesOf(const char* list) {
  if (list == nullptr) return {};
  return absl::StrSplit(list, ',', absl::SkipEmpty());
}

// Options that are not set come from the environment, except its token if `token_file` is set.
client::Credentials CredentialsOf(const partiemc_options& options) {
  client::Credentials result = client::CredentialsFromEnvironment();
  const auto take = [](const char* text, std::string& value) {
    if (text != nullptr) value = text;
  };
  take(options.ca_file, result.ca_file);
  take(options.cert_file, result.cert_file);
  take(options.key_file, result.key_file);
  if (options.token_file != nullptr) result.token.clear();
  take(options.token_file, result.token_file);
  take(options.token, result.token);
  result.tls |= options.tls != 0;
  return result;
}

client::StreamOptions StreamOptionsOf(const partiemc_options& options,
                                      const ReconstructionParameters& parameters,
                                      client::Coordinates coordinates) {
  client::StreamOptions result;
  result.name = Text(options.name);
  result.parameters = parameters;
  result.outputs = {.mesh = parameters.fill != Fill::kNone,
                    .normals = options.normals != 0,
                    .coordinates = coordinates,
                    .echo_particles = options.echo_particles != 0,
                    .attributes = NamesOf(options.attributes)};
  result.credentials = CredentialsOf(options);
  result.connect_timeout = Milliseconds(options.connect_timeout, result.connect_timeout);
  result.deadline = Milliseconds(options.deadline, result.deadline);
  result.reconnect.give_up_after = Milliseconds(
      options.give_up_after, options.latest != 0 ? client::kShortPatience : client::kPatience);
  if (options.send_timeout > 0) result.send_timeout = Milliseconds(options.send_timeout, {});
  result.parts.parts = options.parts;
  result.parts.part = options.part;
  result.parts.token = Text(options.parts_token);
  result.parts.timeout = Milliseconds(options.part_timeout, result.parts.timeout);
  return result;
}

absl::Status Open(const char* address, const partiemc_options& options, partiemc_stream& opened) {
  if (absl::Status status = CheckTimes(options); !status.ok()) return status;
  const auto parameters = ParametersOf(options);
  if (!parameters.ok()) return parameters.status();
  client::Coordinates coordinates = client::Coordinates::kFloat64;
  if (options.coordinates != nullptr) {
    const absl::Status named = SetByName(options.coordinates, coordinates);
    if (!named.ok()) return named;
  }
  if (options.parts > 0 && (address == nullptr || options.latest != 0)) {
    return absl::InvalidArgumentError(
        "parts: needs an address and no `latest`: parts of a frame meet at a server");
  }
  if (address == nullptr) {
    auto stream = LocalStream::Open({.parameters = *parameters,
                                     .attributes = NamesOf(options.attributes),
                                     .threads = options.threads});
    if (!stream.ok()) return stream.status();
    opened.stream = *std::move(stream);
  } else {
    auto stream = Stream::Open(*address == '\0' ? client::ServerFromEnvironment() : address,
                               StreamOptionsOf(options, *parameters, coordinates));
    if (!stream.ok()) return stream.status();
    opened.stream = *std::move(stream);
  }
  opened.shows_normals = options.normals != 0;
  if (options.latest != 0) opened.latest = std::make_unique<LatestSender>(*opened.stream);
  return absl::OkStatus();
}

absl::Status Send(partiemc_stream& stream, const partiemc_particles* particles, double time,
                  std::uint64_t* sequence) {
  if (sequence != nullptr) *sequence = 0;
  const auto arrays = ArraysOf(particles, stream.sent_attributes);
  if (!arrays.ok()) return arrays.status();
  if (stream.latest != nullptr) return stream.latest->OfferArrays(*arrays, time);
  const auto sent = stream.stream->SendArrays(*arrays, time);
  if (sent.ok() && sequence != nullptr) *sequence = *sent;
  return sent.status();
}

// RingMeasures and ShellMeasures are exposed without conversion.
static_assert(sizeof(RingMeasures) == sizeof(partiemc_ring) &&
              offsetof(RingMeasures, area) == offsetof(partiemc_ring, area) &&
              offsetof(RingMeasures, perimeter) == offsetof(partiemc_ring, perimeter) &&
              offsetof(RingMeasures, centroid_x) == offsetof(partiemc_ring, centroid_x) &&
              offsetof(RingMeasures, centroid_y) == offsetof(partiemc_ring, centroid_y) &&
              offsetof(RingMeasures, particle_count) == offsetof(partiemc_ring, particle_count) &&
              offsetof(RingMeasures, identity) == offsetof(partiemc_ring, identity));
static_assert(kNoRing == PARTIEMC_NO_RING && sizeof(TriangleClass) == 1);
static_assert(sizeof(ShellMeasures) == sizeof(partiemc_shell) &&
              offsetof(ShellMeasures, area) == offsetof(partiemc_shell, area) &&
              offsetof(ShellMeasures, volume) == offsetof(partiemc_shell, volume) &&
              offsetof(ShellMeasures, centroid_x) == offsetof(partiemc_shell, centroid_x) &&
              offsetof(ShellMeasures, centroid_y) == offsetof(partiemc_shell, centroid_y) &&
              offsetof(ShellMeasures, centroid_z) == offsetof(partiemc_shell, centroid_z) &&
              offsetof(ShellMeasures, particles) == offsetof(partiemc_shell, particle_count) &&
              offsetof(ShellMeasures, identity) == offsetof(partiemc_shell, identity));
static_assert(kNoShell == PARTIEMC_NO_SHELL);

void AddAttributes(const std::vector<AttributeValues>& attributes,
                   std::vector<partiemc_values>& values, partiemc_event& event) {
  values.clear();
  for (const AttributeValues& one : attributes) {
    values.push_back({one.name.c_str(), one.components, one.values.data()});
  }
  event.attribute_count = values.size();
  event.attributes = values.data();
}

void AddResult(const Result& result, const OutlineDigests& digests, bool shows_normals,
               std::vector<partiemc_values>& values, partiemc_event& event) {
  const Rings& rings = result.rings;
  const Mesh& mesh = result.mesh;
  const FrameStatistics& statistics = result.statistics;
  event.ring_count = rings.RingCount();
  event.point_count = rings.PointCount();
  event.points = rings.points.data();
  event.offsets = rings.offsets.data();
  event.outer_of = rings.outer_of.data();
  event.rings = reinterpret_cast<const partiemc_ring*>(rings.measures.data());
  if (shows_normals && !rings.normals.empty()) event.normals = rings.normals.data();
  event.mesh_point_count = mesh.PointCount();
  event.triangle_count = mesh.TriangleCount();
  event.mesh_points = mesh.points.data();
  event.triangles = mesh.triangles.data();
  event.triangle_classes = reinterpret_cast<const std::uint8_t*>(mesh.classes.data());
  event.particle_count = statistics.particles;
  event.area = statistics.area;
  event.perimeter = statistics.perimeter;
  event.spacing = statistics.spacing;
  event.cell_size = statistics.cell_size;
  event.rings_digest = digests.rings;
  event.mesh_digest = digests.mesh;
  event.cut_count = rings.cuts.size();
  event.cuts = rings.cuts.data();
  event.cut_bodies = statistics.cut_bodies;
  event.wetted_count = rings.wetted.size();
  event.wetted = rings.wetted.data();
  event.contact_count = rings.contacts.size();
  event.contacts = rings.contacts.data();
  event.contact_angles = rings.contact_angles.data();
  AddAttributes(result.attributes, values, event);
}

partiemc_surface ViewOf(const Surface& surface) {
  const bool is_tracked = surface.parent_offsets.size() == surface.ShellCount() + 1;
  return {.shell_count = surface.ShellCount(),
          .point_count = surface.PointCount(),
          .triangle_count = surface.TriangleCount(),
          .points = surface.points.data(),
          .normals = surface.normals.data(),
          .triangles = surface.triangles.data(),
          .point_offsets = surface.point_offsets.data(),
          .triangle_offsets = surface.triangle_offsets.data(),
          .outer_of = surface.outer_of.data(),
          .shells = reinterpret_cast<const partiemc_shell*>(surface.measures.data()),
          .parents = is_tracked ? surface.parents.data() : nullptr,
          .parent_offsets = is_tracked ? surface.parent_offsets.data() : nullptr,
          .cut_count = surface.cuts.size(),
          .cuts = surface.cuts.data()};
}

// Requires: AddResult has filled `event`.
void AddSurface(const client::FrameResult& frame, partiemc_stream& stream, partiemc_event& event) {
  stream.surface = ViewOf(frame.result.surface);
  event.surface = &stream.surface;
  event.volume = frame.result.statistics.volume;
  event.surface_digest = frame.surface_digest;
  AddAttributes(frame.result.surface.attributes, stream.values, event);
}

partiemc_event Empty(std::int32_t kind) {
  return {.kind = kind, .message = "", .reason = "", .field = "", .value = "", .rule = ""};
}

partiemc_event ViewOf(partiemc_stream& stream) {
  const Event& event = stream.event;
  partiemc_event view = Empty(PARTIEMC_NOTICE);
  view.sequence = event.sequence;
  view.message = event.message.c_str();
  if (event.kind == Event::Kind::kRefusal) {
    view.kind = PARTIEMC_REFUSAL;
    view.reason = event.violation.reason.c_str();
    view.field = event.violation.field.c_str();
    view.value = event.violation.value.c_str();
    view.rule = event.violation.rule.c_str();
  } else if (event.kind == Event::Kind::kPartTaken) {
    view.kind = PARTIEMC_PART_TAKEN;
    view.message = "";
  } else if (event.kind == Event::Kind::kResult) {
    view.kind = PARTIEMC_RESULT;
    view.message = "";
    view.time = event.time;
    view.milliseconds = event.frame.times.total_ms;
    view.section_count = event.frame.result.sections.size();
    AddResult(event.frame.result, {event.frame.rings_digest, event.frame.mesh_digest},
              stream.shows_normals, stream.values, view);
    if (stream.stream->info().parameters.output == Output::kSurface) {
      AddSurface(event.frame, stream, view);
    }
  }
  return view;
}

absl::Status ViewSection(partiemc_stream& stream, std::size_t index, partiemc_event* event) {
  const client::FrameResult& frame = stream.event.frame;
  const std::size_t count =
      stream.event.kind == Event::Kind::kResult ? frame.result.sections.size() : 0;
  if (index >= count) {
    return absl::InvalidArgumentError(
        absl::StrCat("section: ", index, "; must be below the ", count, " of the last event"));
  }
  // Events of other sections point to arrays in `section_values`, so it never shrinks.
  if (stream.section_values.size() < count) stream.section_values.resize(count);
  partiemc_event view = Empty(PARTIEMC_RESULT);
  view.sequence = stream.event.sequence;
  view.time = stream.event.time;
  AddResult(frame.result.sections[index], frame.section_digests[index], stream.shows_normals,
            stream.section_values[index], view);
  Give(view, event->size, event);
  return absl::OkStatus();
}

absl::Status Receive(partiemc_stream& stream, double wait, partiemc_event* event) {
  const std::optional<std::chrono::milliseconds> bound =
      wait < 0 ? std::nullopt : std::optional(Milliseconds(wait, std::chrono::milliseconds(0)));
  const auto received = stream.stream->Receive(stream.event, bound);
  if (!received.ok()) return received.status();
  if (*received == Received::kEvent) {
    Give(ViewOf(stream), event->size, event);
  } else {
    Give(Empty(*received == Received::kEnd ? PARTIEMC_END : PARTIEMC_NOTHING_YET), event->size,
         event);
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace partiemc::c

using partiemc::c::Guarded;

void partiemc_options_init(partiemc_options* options, size_t size) {
  partiemc::c::Give(partiemc_options{}, size, options);
}

partiemc_code partiemc_open(const char* address, const partiemc_options* options,
                            partiemc_stream** stream) {
  *stream = nullptr;
  return Guarded([&] {
    auto opened = std::make_unique<partiemc_stream>();
    const absl::Status status =
        partiemc::c::Open(address, partiemc::c::Take(options, partiemc_options{}), *opened);
    if (status.ok()) *stream = opened.release();
    return status;
  });
}

void partiemc_close(partiemc_stream* stream) {
  if (stream != nullptr) stream->latest.reset();
  delete stream;
}

partiemc_code partiemc_send(partiemc_stream* stream, const partiemc_particles* particles,
                            double time, uint64_t* sequence) {
  return Guarded([&] { return partiemc::c::Send(*stream, particles, time, sequence); });
}

partiemc_code partiemc_finish(partiemc_stream* stream) {
  return Guarded([&] {
    return stream->latest != nullptr ? stream->latest->Finish() : stream->stream->FinishSending();
  });
}

void partiemc_cancel(partiemc_stream* stream) { stream->stream->Cancel(); }

size_t partiemc_in_flight(const partiemc_stream* stream) { return stream->stream->InFlight(); }

size_t partiemc_window(const partiemc_stream* stream) {
  return stream->stream->info().frames_in_flight;
}

void partiemc_latest_counts(const partiemc_stream* stream, uint64_t* sent, uint64_t* skipped,
                            uint64_t* refused) {
  partiemc::client::OfferCounts counts;
  if (stream->latest != nullptr) counts = stream->latest->counts();
  if (sent != nullptr) *sent = counts.sent;
  if (skipped != nullptr) *skipped = counts.skipped;
  if (refused != nullptr) *refused = counts.refused;
}

void partiemc_event_init(partiemc_event* event, size_t size) {
  partiemc::c::Give(partiemc::c::Empty(PARTIEMC_NOTHING_YET), size, event);
}

partiemc_code partiemc_receive(partiemc_stream* stream, double wait, partiemc_event* event) {
  return Guarded([&] { return partiemc::c::Receive(*stream, wait, event); });
}

partiemc_code partiemc_event_section(partiemc_stream* stream, size_t index, partiemc_event* event) {
  return Guarded([&] { return partiemc::c::ViewSection(*stream, index, event); });
}

partiemc_code partiemc_reconstruct(partiemc_stream* stream, const partiemc_particles* particles,
                                   double time, partiemc_event* event) {
  return Guarded([&]() -> absl::Status {
    if (stream->latest != nullptr || stream->stream->InFlight() > 0) {
      return absl::FailedPreconditionError(
          "partiemc_reconstruct: needs a stream without `latest` and without frames in flight");
    }
    absl::Status status = partiemc::c::Send(*stream, particles, time, nullptr);
    do {
      if (status.ok()) status = partiemc::c::Receive(*stream, -1, event);
    } while (status.ok() && stream->event.kind != Event::Kind::kResult &&
             stream->event.kind != Event::Kind::kRefusal &&
             stream->event.kind != Event::Kind::kPartTaken);
    return status;
  });
}
