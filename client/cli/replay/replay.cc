#include "client/cli/replay/replay.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "client/cli/console.h"
#include "client/cli/input_source.h"
#include "client/cli/replay/frame_feeder.h"
#include "client/cli/replay/looped_input.h"
#include "client/cli/replay/missing_phases.h"
#include "client/cli/replay/particle_places.h"
#include "client/cli/replay/refusal_text.h"
#include "client/cli/replay/replay_outputs.h"
#include "client/cli/replay_parameters.h"
#include "client/library/adapters/seconds.h"
#include "client/output/progress.h"
#include "client/output/text.h"
#include "common/printable.h"
#include "common/text.h"
#include "partiemc/client/local_stream.h"
#include "partiemc/client/stream.h"
#include "partiemc/validate.h"

namespace partiemc::client {
namespace {

using Clock = std::chrono::steady_clock;

// Poll interval for Ctrl-C while waiting for a response.
constexpr std::chrono::milliseconds kPollInterval(100);

// The name of the input as a label: at most 128 bytes, printable.
std::string InputLabel(const std::string& input) {
  std::string label = Printable(BaseName(input)).substr(0, 128);
  while (!IsPrintable(label)) label.pop_back();  // The cut may split a character.
  return label;
}

absl::StatusOr<std::unique_ptr<FrameStream>> OpenStream(const ReplayFlags& flags,
                                                        const ReconstructionParameters& parameters,
                                                        bool normals) {
  if (flags.local) {
    auto stream = LocalStream::Open({.parameters = parameters,
                                     .attributes = flags.sequence.attributes,
                                     .threads = flags.threads});
    if (!stream.ok()) return stream.status();
    return *std::move(stream);
  }
  const std::chrono::milliseconds patience = flags.policy == "latest" ? kShortPatience : kPatience;
  const std::vector<std::string_view> servers = Split(flags.server.address, ',');
  auto stream = Stream::Open(
      servers.front(),
      {.name = flags.name,
       .parameters = parameters,
       .outputs = {.mesh = parameters.fill != Fill::kNone,
                   .normals = normals,
                   .coordinates = CoordinatesOf(flags.coordinates),
                   .echo_particles = flags.echo_particles,
                   .attributes = flags.sequence.attributes},
       .labels = {{"input", InputLabel(flags.input)}},
       .credentials = flags.server.credentials,
       .deadline = ToMilliseconds(flags.deadline_seconds),
       .fallback_addresses = {servers.begin() + 1, servers.end()},
       .checkpoint_interval = flags.checkpoint_interval,
       .reconnect = {.give_up_after = flags.give_up_after_seconds
                                          ? ToMilliseconds(*flags.give_up_after_seconds)
                                          : patience,
                     .announce = true}});
  if (!stream.ok()) return stream.status();
  return *std::move(stream);
}

std::string SpacingText(double spacing, std::string_view source) {
  return Concat("spacing ", spacing, " estimated from ", source, "; --spacing sets it");
}

struct ReplayEnd {
  ExitCode code = kGood;
  std::string error = {};  // Empty for kGood and kInterrupted.
};

// The receiving half of a replay: responses -> check -> outputs, until the stream ends.
class Receiver {
 public:
  Receiver(const ReplayFlags& flags, FrameStream& stream, FrameFeeder& feeder,
           ReplayOutputs& outputs, Progress& progress)
      : flags_(flags),
        stream_(stream),
        feeder_(feeder),
        outputs_(outputs),
        progress_(progress),
        sections_in_plane_(SectionsInPlane(stream.info().parameters)),
        missing_phases_(stream.info().parameters),
        particle_places_(flags, stream.info().parameters) {}

  /// kGood at the end of the stream, when every frame has a response.
  ReplayEnd Run() {
    while (!Interrupted()) {
      const auto received = stream_.Receive(event_, kPollInterval);
      for (const auto& refused : feeder_.TakeRefused()) Refuse(refused.source, refused.message);
      if (!received.ok()) return {kServer, OneLine(received.status())};
      if (*received == Received::kEnd) return {};
      if (*received == Received::kNothingYet) {
        if (const auto lost = stream_.reconnecting()) progress_.Wait(WaitingText(*lost));
        continue;
      }
      if (const absl::Status status = Take(); !status.ok()) return {kFailed, OneLine(status)};
    }
    return {kInterrupted};
  }

  std::uint64_t answered() const { return answered_; }
  std::uint64_t failed_checks() const { return failed_checks_; }
  const MissingPhases& missing_phases() const { return missing_phases_; }
  const ParticlePlaces& particle_places() const { return particle_places_; }

 private:
  absl::Status Take() {
    if (event_.kind == Event::Kind::kNotice) {
      progress_.Note("partiemc: notice of the server: " + OneLine(event_.message));
      return absl::OkStatus();
    }
    if (event_.kind == Event::Kind::kReconnected) {
      progress_.Note("partiemc: " + OneLine(event_.message));
      return absl::OkStatus();
    }
    std::unique_ptr<RecordedFrame> frame = feeder_.TakeAnswered();
    missing_phases_.Remove(*frame);
    particle_places_.Add(*frame);
    absl::Status status;
    if (event_.kind == Event::Kind::kRefusal) {
      Refuse(frame->source, RefusalText(*frame, flags_.sequence.attributes, event_.message));
    } else {
      if (flags_.check) Check(frame->source);
      TellSpacing(frame->source);
      // A loop has no outputs.
      if (!flags_.loop) {
        const AttributeValues color = ParticleColor(*frame);
        const std::vector<float> areas = ParticleAreas(*frame), sizes = ParticleSizes(*frame);
        status = outputs_.Write({.index = frame->index,
                                 .time = event_.time,
                                 .result = event_.frame.result,
                                 .surface = flags_.surface ? &event_.frame.result.surface : nullptr,
                                 .particles = PlaneParticles(*frame),
                                 .particles_in_space = SpaceParticles(*frame),
                                 .particle_areas = areas,
                                 .particle_sizes = sizes,
                                 .are_discs = HasGrains(),
                                 .stages_ms = event_.frame.times.stages_ms,
                                 .total_ms = event_.frame.times.total_ms,
                                 .rings_digest = event_.frame.rings_digest,
                                 .mesh_digest = event_.frame.mesh_digest,
                                 .surface_digest = event_.frame.surface_digest,
                                 .section_digests = event_.frame.section_digests,
                                 .sections_in_plane = sections_in_plane_,
                                 .particle_color = &color});
      }
    }
    feeder_.Recycle(std::move(frame));
    progress_.Update(++answered_);
    return status;
  }

  /// Returns no particles for 3D frames, because they do not lie in the plane of the outline.
  static std::span<const double> PlaneParticles(const RecordedFrame& frame) {
    if (frame.components != 2) return {};
    return frame.positions;
  }

  /// The particles of a surface, which the report draws.
  std::span<const double> SpaceParticles(const RecordedFrame& frame) const {
    if (!flags_.surface || frame.components != 3) return {};
    return frame.positions;
  }

  /// The areas of the particles in the plane, for gauges: of discs with the attribute `radius` or
  /// `diameter`, else from the volumes (AreasOf). Empty without gauges, and for 3D particles.
  std::vector<float> ParticleAreas(const RecordedFrame& frame) const {
    if (flags_.files.gauges.empty() || frame.components != 2) return {};
    for (const ParticleAttribute& attribute : frame.attributes) {
      const bool is_diameter = attribute.name == "diameter";
      if (attribute.components != 1 || !(is_diameter || attribute.name == "radius")) continue;
      std::vector<float> areas;
      for (const float size : attribute.values) {
        const double radius = double{size} / (is_diameter ? 2 : 1);
        areas.push_back(static_cast<float>(std::numbers::pi * radius * radius));
      }
      return areas;
    }
    return AreasOf(frame.volumes, stream_.info().parameters.boundary);
  }

  bool HasGrains() const { return stream_.info().parameters.boundary == Boundary::kGrains; }

  /// The sizes with which the particles are drawn; empty for equal sizes, and for 3D particles.
  std::vector<float> ParticleSizes(const RecordedFrame& frame) const {
    if (frame.components != 2) return {};
    return SizesOf(frame.volumes, stream_.info().parameters.sizes);
  }

  /// The attribute of --color-by at the particles, for the report; empty without one.
  AttributeValues ParticleColor(const RecordedFrame& frame) const {
    if (flags_.files.color_by.empty() || flags_.report.empty()) return {};
    for (const ParticleAttribute& attribute : frame.attributes) {
      if (attribute.name == flags_.files.color_by) {
        return {attribute.name, attribute.components, attribute.values};
      }
    }
    if (flags_.files.color_by != kVelocityAttribute || frame.velocities.empty()) return {};
    return {flags_.files.color_by, frame.components, frame.velocities};
  }

  void Check(const std::string& source) {
    const Fill fill = *FindFill(flags_.fill);
    absl::Status valid = Validate(event_.frame.result, fill);
    for (const Result& section : event_.frame.result.sections) {
      valid.Update(Validate(section, fill));
    }
    if (!flags_.local) valid.Update(CheckDigests());  // LocalStream computes them itself.
    if (valid.ok()) return;
    // A placement without guarantees breaks them in almost every frame, so only the first failure
    // is printed.
    const std::uint64_t told = KeepsGuarantees(*FindPlacement(flags_.placement)) ? 10 : 1;
    if (++failed_checks_ > told) return;
    progress_.Note(Concat("partiemc: ", source, ": --check: ", OneLine(valid)));
  }

  // Compares the received geometry with its digests, which the server has computed.
  absl::Status CheckDigests() const {
    const FrameResult& frame = event_.frame;
    if (DigestRings(frame.result.rings) == frame.rings_digest &&
        DigestMesh(frame.result.mesh) == frame.mesh_digest &&
        DigestSurface(frame.result.surface) == frame.surface_digest &&
        DigestSections(frame.result) == frame.section_digests) {
      return absl::OkStatus();
    }
    return absl::InternalError("the geometry is not that of its digests: report this");
  }

  // Prints the spacing of the first outline for which it was estimated.
  void TellSpacing(const std::string& source) {
    const FrameStatistics& statistics = event_.frame.result.statistics;
    if (flags_.quiet || is_spacing_told_ || stream_.info().parameters.spacing) return;
    if (statistics.spacing == 0 || statistics.doubts.Has(Doubt::kSpacingProvisional)) return;
    is_spacing_told_ = true;
    progress_.Note("partiemc: " + SpacingText(statistics.spacing, source));
  }

  void Refuse(const std::string& source, const std::string& message) {
    outputs_.AddRefused();
    progress_.Note(Concat("partiemc: ", OneLine(source), ": frame refused: ", OneLine(message)));
  }

  const ReplayFlags& flags_;
  FrameStream& stream_;
  FrameFeeder& feeder_;
  ReplayOutputs& outputs_;
  Progress& progress_;
  const std::vector<std::size_t> sections_in_plane_;
  MissingPhases missing_phases_;
  ParticlePlaces particle_places_;
  Event event_;
  bool is_spacing_told_ = false;
  std::uint64_t answered_ = 0, failed_checks_ = 0;
};

// Why the replay ended early; empty for a complete one.
std::string WhyEarly(ExitCode ended, const absl::Status& input_status) {
  if (ended == kInterrupted) return "interrupted";
  if (ended == kServer) return "the server was lost, or ended the stream";
  if (ended != kGood) return "an output could not be written";
  return input_status.ok() ? "" : "the input could not be read further";
}

// Prints warnings and failures of a complete replay. Returns the exit code.
ExitCode Conclude(const ReplayFlags& flags, const ReconstructionParameters& parameters,
                  const ReplayOutputs& outputs, const Receiver& receiver) {
  const std::uint64_t failed_checks = receiver.failed_checks();
  const Summary& summary = outputs.summary();
  ExitCode code = kGood;
  const std::vector<std::string> of_input = summary.Warnings();
  for (const std::string& warning : of_input) Complain(kGood, warning);
  for (const std::string& warning : receiver.missing_phases().Warnings()) Complain(kGood, warning);
  const std::vector<std::string> of_places = receiver.particle_places().Warnings();
  for (const std::string& warning : of_places) Complain(kGood, warning);
  if (summary.is_empty()) {
    Complain(kGood, Concat("no frame has ", flags.surface ? "a body" : "an outline",
                           of_input.empty() && of_places.empty() ? "; is --spacing right?" : ""));
  }
  if (summary.refused_count() > 0 && !flags.keep_going) {
    Complain(kInput, Concat(Plural(summary.refused_count(), "frame"),
                            " refused, see above; --keep-going exits with 0 nevertheless"));
    code = kInput;
  }
  if (failed_checks > 0) {
    // If the placement guarantees nothing, failures are printed but do not change the exit code.
    const bool expected = !KeepsGuarantees(parameters.placement);
    Complain(kFailed, Concat("--check: ", Plural(failed_checks, "frame"), " of ",
                             summary.frame_count(), " broke a guarantee",
                             expected ? Concat(", as ", Name(parameters.placement), " may")
                                      : std::string()));
    if (!expected) code = kFailed;
  }
  const bool has_files =
      !flags.files.output_dir.empty() || !flags.files.stats.empty() || !flags.report.empty();
  if (flags.local && !has_files && !flags.check && !flags.quiet) {
    Complain(kGood, "no file was written; --output-dir, --stats and --report write files");
  }
  return code;
}

// The box of the first frame, if --periodic requires the box of the input.
absl::StatusOr<std::optional<RecordedBox>> BoxOfInput(const ReplayFlags& flags) {
  if (flags.periodic.empty() || !flags.box.empty()) return std::nullopt;
  auto input = OpenInput(flags.input, flags.sequence);
  if (!input.ok()) return input.status();
  RecordedFrame first;
  const auto found = input->frames->Next(first);
  if (!found.ok()) return found.status();
  if (!*found) return absl::FailedPreconditionError(Concat(flags.input, ": has no frame"));
  if (auto status = CheckBox(first); !status.ok()) return status;
  return first.box;
}

}  // namespace

int Replay(const ReplayFlags& given) {
  ReplayFlags flags = given;
  // The reader must also read the attribute of phases.
  std::vector<std::string>& attributes = flags.sequence.attributes;
  const std::string phases = PhaseAttributeOf(flags);
  if (!phases.empty() && std::ranges::find(attributes, phases) == attributes.end()) {
    attributes.push_back(phases);
  }
  const auto rate = RateOf(flags.rate);
  if (!rate.ok()) return Complain(kUsage, rate.status());
  // Checks the flags before the input is opened. Slices and surfaces require a spacing; 1.0 stands
  // for the spacing of the input.
  const auto without_input = ParametersOf(flags, 1.0);
  if (!without_input.ok()) return Complain(kUsage, without_input.status());

  auto input = OpenInput(flags.input, flags.sequence);
  if (!input.ok()) {
    const bool wrong_flag = input.status().code() == absl::StatusCode::kInvalidArgument;
    return Complain(wrong_flag ? kUsage : kInput, input.status());
  }
  if (IsEstimatedInSpace(flags, input->spacing)) {
    const auto spacing = EstimatedSpacing(flags.input, flags.sequence);
    if (!spacing.ok()) return Complain(kInput, spacing.status());
    input->spacing = *spacing;
    if (!flags.quiet) {
      Complain(kGood, SpacingText(*spacing, "the first frame"));
    }
  }
  const auto box = BoxOfInput(flags);
  if (!box.ok()) return Complain(kInput, box.status());
  const auto parameters = ParametersOf(flags, input->spacing, *box);
  if (!parameters.ok()) return Complain(kUsage, parameters.status());
  if (flags.loop) {
    input->frames = std::make_unique<LoopedInput>(*std::move(input), flags.input, flags.sequence);
  }
  CatchInterrupts();  // Before the first temporary file exists.
  auto outputs = ReplayOutputs::Create(flags, *parameters, *input->frames);
  if (!outputs.ok()) {
    const bool wrong_flag = outputs.status().code() == absl::StatusCode::kInvalidArgument;
    return Complain(wrong_flag ? kUsage : kFailed, outputs.status());
  }
  const auto stream = OpenStream(flags, *parameters, outputs->WantsNormals());
  if (!stream.ok()) {
    // This verb works without a server, too.
    const std::string why = OneLine(stream.status());
    if (!why.starts_with("no server")) return ComplainOfServer(stream.status());
    return Complain(kServer, why + ", or use --local");
  }

  Progress::Options progress_options = Progress::ForStandardError();
  progress_options.quiet = flags.quiet;
  progress_options.total = input->frames->FrameCount();
  Progress progress(std::move(progress_options));
  const Clock::time_point start = Clock::now();
  FrameFeeder feeder(*input->frames, **stream, *rate,
                     flags.policy == "latest" ? SendPolicy::kLatest : SendPolicy::kBlock,
                     flags.sequence.attributes, *box ? parameters->box : std::nullopt);
  Receiver receiver(flags, **stream, feeder, *outputs, progress);
  const ReplayEnd ended = receiver.Run();
  if (ended.code != kGood) feeder.Stop();
  const absl::Status input_status = feeder.Join();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  progress.Finish();

  PrintNotices(*input->frames, flags.quiet);
  if (!flags.quiet && feeder.skipped_count() > 0) {
    Complain(kGood, Concat(Plural(feeder.skipped_count(), "frame"),
                           " skipped because newer ones arrived (--policy latest)"));
  }
  const std::string early = WhyEarly(ended.code, input_status);
  if (!early.empty()) outputs->EndEarly(early);
  const Summary& summary = outputs->summary();
  absl::Status finished;
  if (summary.frame_count() + (early.empty() ? summary.refused_count() : 0) > 0) {
    finished = outputs->Finish(seconds);
    if (!flags.quiet && finished.ok()) std::fputs(summary.Table(seconds).c_str(), stdout);
  } else if (early.empty()) {
    return Complain(kInput, Concat(flags.input, ": has no frame to replay; check --frames"));
  }
  // After kFailed an output is broken, so Finish fails, too. Only the first error is printed.
  if (!finished.ok() && ended.code != kFailed) Complain(kFailed, finished);
  if (ended.code == kInterrupted) {
    return Complain(kInterrupted,
                    Concat("interrupted after ", Plural(receiver.answered(), "frame")));
  }
  if (ended.code != kGood) return Complain(ended.code, ended.error);
  if (!input_status.ok()) return Complain(kInput, input_status);
  if (!finished.ok()) return kFailed;
  return Conclude(flags, *parameters, *outputs, receiver);
}

}  // namespace partiemc::client
