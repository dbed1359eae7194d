#include "client/cli/stream_recorder.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "client/output/text.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

template <typename Value>
void AddFlag(std::string& flags, std::string_view flag, const Value& value,
             const Value& default_value) {
  if (value == default_value) return;
  if constexpr (std::is_floating_point_v<Value>) {
    AppendAll(flags, " ", flag, " ", ShortestNumber(value));
  } else {
    AppendAll(flags, " ", flag, " ", value);
  }
}

// Quotes untrusted text as one word for a shell.
std::string Quoted(std::string_view text) {
  const bool is_plain = std::ranges::all_of(text, [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.' ||
           c == '/';
  });
  if (is_plain && !text.empty()) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') {
      quoted += "'\\''";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

// The value of --phases and of --wall for particles.
std::string PhasesOf(const std::string& attribute, const std::vector<std::int32_t>& phases) {
  const std::vector<double> numbers(phases.begin(), phases.end());
  return Concat(Quoted(attribute), "=", NumberList(numbers));
}

// The value of --slice.
std::string TextOf(const SlicePlane& slice) {
  return Concat(NumberList(slice.origin), ",", NumberList(slice.normal));
}

// The flags name only the periodic axes: the recording holds the box of each frame.
std::string PeriodicFlagsOf(const PeriodicBox& box) {
  std::string flags;
  for (std::size_t k = 0; k < box.axes.size(); ++k) {
    if (box.axes[k])
      AppendAll(flags, flags.empty() ? " --periodic " : ",", std::string(1, "xyz"[k]));
  }
  return box.wraps ? flags + " --wrap" : flags;
}

std::optional<RecordedBox> RecordedBoxOf(const std::optional<PeriodicBox>& box) {
  if (!box) return std::nullopt;
  RecordedBox recorded;
  for (std::size_t k = 0; k < box->axes.size(); ++k) {
    const auto& axis = box->axes[k];
    if (!axis) continue;
    recorded.low[k] = axis->origin;
    recorded.length[k] = axis->length;
    recorded.is_periodic[k] = true;
  }
  return recorded;
}

}  // namespace

std::string ReplayFlagsOf(const ReconstructionParameters& parameters) {
  const ReconstructionParameters defaults;
  std::string flags;
  if (parameters.output == Output::kSurface) {
    const SurfaceOptions& surface = parameters.surface;
    AppendAll(flags, " --surface");
    AddFlag(flags, "--thinning-distance", surface.thinning_distance,
            defaults.surface.thinning_distance);
    AddFlag(flags, "--simplify", surface.simplify, defaults.surface.simplify);
    AddFlag(flags, "--max-drop-particles", surface.max_drop_particles,
            defaults.surface.max_drop_particles);
    AddFlag(flags, "--min-volume", surface.min_component_volume,
            defaults.surface.min_component_volume);
    for (const Section& section : parameters.sections) {
      if (section.slice && !section.isovalue) AppendAll(flags, " --slice ", TextOf(*section.slice));
    }
  }
  AddFlag(flags, "--placement", Name(parameters.placement), Name(defaults.placement));
  AddFlag(flags, "--fill", Name(parameters.fill), Name(defaults.fill));
  if (!parameters.spacing && parameters.spacing_rule == SpacingRule::kEveryFrame) {
    AppendAll(flags, " --spacing every-frame");
  }
  AddFlag(flags, "--sizes", Name(parameters.sizes), Name(defaults.sizes));
  AddFlag(flags, "--boundary", Name(parameters.boundary), Name(defaults.boundary));
  AddFlag(flags, "--kernel-radius", parameters.kernel_radius, defaults.kernel_radius);
  AddFlag(flags, "--cell-size", parameters.cell_size, defaults.cell_size);
  if (parameters.reference_radius) {
    AppendAll(flags, " --reference-radius ", ShortestNumber(*parameters.reference_radius));
  }
  AddFlag(flags, "--surface-offset", parameters.surface_offset, defaults.surface_offset);
  AddFlag(flags, "--attribute-tolerance", parameters.attribute_tolerance,
          defaults.attribute_tolerance);
  if (!parameters.normal_memory) AppendAll(flags, " --no-normal-memory");
  if (parameters.clean) AppendAll(flags, " --clean ", *parameters.clean ? "on" : "off");
  AddFlag(flags, "--min-area", parameters.min_component_area, defaults.min_component_area);
  AddFlag(flags, "--min-particles", parameters.min_component_particles,
          defaults.min_component_particles);
  if (parameters.noise_filter) {
    AppendAll(flags, " --noise-filter ", ShortestNumber(*parameters.noise_filter));
  }
  for (const Wall& wall : parameters.walls) AppendAll(flags, " --wall ", NumberList(wall.points));
  for (const WallPlane& wall : parameters.wall_planes) {
    AppendAll(flags, " --wall-plane ", std::string(1, "xyz"[wall.axis]), "=",
              ShortestNumber(wall.position), wall.is_fluid_above ? "" : ",below");
  }
  if (!parameters.wall_phases.empty()) {
    AppendAll(flags, " --wall ", PhasesOf(parameters.phase_attribute, parameters.wall_phases));
  }
  std::vector<std::int32_t> phases;
  for (const Section& section : parameters.sections) {
    if (section.phase) phases.push_back(*section.phase);
  }
  if (!phases.empty()) {
    AppendAll(flags, " --phases ", PhasesOf(parameters.phase_attribute, phases));
  }
  std::string isovalues;
  for (const Section& section : parameters.sections) {
    // Every slice has the same isolines, so those on the slice of the first section suffice.
    if (!section.isovalue || section.slice != parameters.sections.front().slice) continue;
    AppendAll(isovalues, isovalues.empty() ? "" : ",", ShortestNumber(*section.isovalue));
  }
  if (!isovalues.empty()) AppendAll(flags, " --isolines ", isovalues);
  return flags;
}

StreamRecorder::StreamRecorder(std::string path, const ReconstructionParameters& parameters,
                               std::unique_ptr<RecordingWriter> writer)
    : path_(std::move(path)),
      flags_(ReplayFlagsOf(parameters)),
      has_isovalue_(parameters.isovalue.has_value()),
      writer_(std::move(writer)) {
  if (parameters.output == Output::kSurface) frame_.components = 3;
}

absl::StatusOr<StreamRecorder> StreamRecorder::Create(const std::string& path,
                                                      const std::string& stream_name,
                                                      const WatchedStream& stream) {
  auto writer = RecordingWriter::Create(
      path, {.spacing = stream.parameters.spacing, .title = stream_name}, {.float64 = true});
  if (!writer.ok()) return writer.status();
  return StreamRecorder(path, stream.parameters, *std::move(writer));
}

absl::Status StreamRecorder::Add(WatchedFrame& frame) {
  if (frame.particles.empty() && frame.frame.result.statistics.particles > 0) {
    return absl::FailedPreconditionError(
        "--record: the producer does not send its particles to watchers; set this at the producer, "
        "not here: `partiemc replay --echo-particles`, in Python "
        "`partiemc.connect(..., echo_particles=True)`, in C `options.echo_particles = 1`, in C++ "
        "`StreamOptions::outputs.echo_particles`");
  }
  if (writer_->frame_count() == 0) {
    first_sequence_ = frame.sequence;
    const Result& result = frame.frame.result;
    const auto& attributes = frame_.components == 3 ? result.surface.attributes : result.attributes;
    for (const AttributeValues& one : attributes) {
      AppendAll(attributes_, attributes_.empty() ? " --attributes " : ",", Quoted(one.name));
    }
    if (frame.particle_box) AppendAll(flags_, PeriodicFlagsOf(*frame.particle_box));
  }
  missed_ += frame.dropped + frame.gap;
  frame_.index = writer_->frame_count();
  frame_.time = frame.time;
  frame_.source = Concat("frame ", frame.sequence);
  frame_.positions.swap(frame.particles);
  frame_.ids.swap(frame.particle_ids);
  frame_.volumes.swap(frame.particle_volumes);
  frame_.velocities.swap(frame.particle_velocities);
  frame_.box = RecordedBoxOf(frame.particle_box);
  frame_.attributes.resize(frame.particle_attributes.size());
  for (std::size_t k = 0; k < frame_.attributes.size(); ++k) {
    const auto& [name, components, values] = frame.particle_attributes[k];
    frame_.attributes[k] = {.name = name, .components = components, .values = values};
  }
  const absl::Status status = writer_->Add(frame_);
  frame_.positions.swap(frame.particles);
  frame_.ids.swap(frame.particle_ids);
  frame_.volumes.swap(frame.particle_volumes);
  frame_.velocities.swap(frame.particle_velocities);
  return status;
}

absl::Status StreamRecorder::Finish() {
  return writer_->frame_count() == 0 ? absl::OkStatus() : writer_->Finish();
}

std::string StreamRecorder::Summary() const {
  if (writer_->frame_count() == 0) return "recorded: no frame, so there is no file\n";
  std::string text =
      Concat("recorded: ", Plural(writer_->frame_count(), "frame"), "; partiemc replay ",
             Quoted(path_), " --local", flags_, attributes_, "\n");
  if (has_isovalue_) {
    AppendAll(text,
              "the stream has an isovalue, for which replay has no option: a replay differs\n");
  }
  if (first_sequence_ > 1) {
    AppendAll(text, "begins with frame ", first_sequence_,
              ": a replay lacks the state of the stream before it\n");
  }
  if (missed_ > 0) {
    AppendAll(text, "lacks at most ", Plural(missed_, "frame"),
              ": a replay may differ after each gap\n");
  }
  return text;
}

}  // namespace partiemc::client
