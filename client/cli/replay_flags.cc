#include "client/cli/replay_flags.h"

#include <string>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/input_source.h"
#include "client/output/frame_writer.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

absl::Status CheckCombinations(const CLI::App& app) {
  if (app.count("--threads") > 0 && app.count("--local") == 0) {
    return absl::InvalidArgumentError("--threads: goes with --local; a server has its own");
  }
  if (app.count("--format") > 0 && app.count("--output-dir") == 0) {
    return absl::InvalidArgumentError("--format: goes with --output-dir, the place of the files");
  }
  if (app.count("--color-by") > 0 &&
      (app.count("--attributes") == 0 ||
       (app.count("--output-dir") == 0 && app.count("--report") == 0))) {
    return absl::InvalidArgumentError(
        "--color-by: goes with --attributes, which names it, and --output-dir or --report");
  }
  if (app.count("--loop") > 0) {
    for (const char* output : {"--output-dir", "--stats", "--report"}) {
      if (app.count(output) > 0) {
        return absl::InvalidArgumentError(
            Concat("--loop: has no end, hence no ", output, "; leave one of them out"));
      }
    }
  }
  return absl::OkStatus();
}

void AddInputFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Input";
  app.add_option("INPUT", flags.input,
                 "Recording (.pemc), file, directory or quoted pattern of particle frames")
      ->type_name("")
      ->required();
  app.add_option("--select", flags.sequence.select, "Keep the particles with COLUMN=VALUE: type=1")
      ->type_name("COLUMN=VALUE")
      ->allow_extra_args(false)
      ->group(kGroup);
  app.add_option("--columns", flags.sequence.columns, "Columns of the positions: x,y or 2,3")
      ->type_name("NAMES")
      ->group(kGroup);
  AddAttributesFlag(
      app, flags.sequence,
      "What particles carry that is wanted at the vertices, too: columns, arrays of two "
      "or three components, or velocity")
      ->group(kGroup);
  app.add_option("--times", flags.sequence.times, "CSV file with the times of the frames")
      ->type_name("FILE")
      ->group(kGroup);
  app.add_option("--frames", flags.sequence.frames, "Frames A to B - 1, counted from 0: A:B")
      ->type_name("A:B")
      ->group(kGroup);
  AddExpansionFlag(app, flags.sequence)->group(kGroup);
  app.add_option("--rate", flags.rate, "Frames per second to send at, or max")
      ->type_name("FPS")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--policy", flags.policy,
                 "Where frames come faster than they are taken: block (they wait, none is lost) or "
                 "latest (the newest is sent, others are skipped and counted)")
      ->check(CLI::IsMember({"block", "latest"}))
      ->type_name("WHICH")
      ->capture_default_str()
      ->group(kGroup);
  app.add_flag("--loop", flags.loop,
               "Begin anew when the input ends, until Ctrl-C, for others to watch; writes no files")
      ->group(kGroup);
}

void AddPlaceFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Where";
  CLI::Option* const server = AddServerFlags(app, flags.server, kGroup);
  server->description("Server: HOST:PORT or unix:PATH; several, to go on with when one is lost")
      ->multi_option_policy(CLI::MultiOptionPolicy::Join)
      ->delimiter(',');
  app.add_option("--checkpoint-interval", flags.checkpoint_interval,
                 "A server sends what another one needs to go on with every such frame; 0: never, "
                 "and a lost server ends the replay")
      ->type_name("K")
      ->check(CLI::Range(0u, 1'000'000u))
      ->capture_default_str()
      ->group(kGroup);
  CLI::Option* const name =
      app.add_option("--name", flags.name, "Of the stream, for `partiemc watch NAME`")
          ->type_name("NAME")
          ->group(kGroup);
  CLI::Option* const echo =
      app.add_flag("--echo-particles", flags.echo_particles, "Who watches gets the particles too")
          ->group(kGroup);
  app.add_flag("--local", flags.local, "Reconstruct in this process, without a server")
      ->excludes(server)
      ->excludes(name)
      ->excludes(echo)
      ->group(kGroup);
  app.add_option("--threads", flags.threads, "Threads with --local; all processors by default")
      ->check(CLI::Range(1, 1024))
      ->group(kGroup);
  app.add_option("--deadline", flags.deadline_seconds, "Seconds that an answer may take")
      ->check(CLI::Range(0.001, 86400.0))
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--give-up-after", flags.give_up_after_seconds,
                 "How long to try to mend a lost connection, in seconds; 0: not at all (default: "
                 "300, with --policy latest 30)")
      ->check(CLI::Range(0.0, 86400.0))
      ->type_name("SECONDS")
      ->group(kGroup);
}

void AddMethodFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Method (lengths in spacings)";
  app.add_option("--placement", flags.placement,
                 "marching-squares, qef, farthest-particle or virtual-plane")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--fill", flags.fill, "greedy, conforming, polygon, grid or none")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--spacing", flags.spacing,
                 "Particle spacing in world units, first-frame or every-frame (estimated); by "
                 "default what the recording knows, else first-frame")
      ->type_name("S|RULE")
      ->group(kGroup);
  app.add_option("--slice", flags.slices,
                 "Of particles in space the section with a plane: x=C, y=C, z=C, or six numbers, a "
                 "point of it and its normal; wants --spacing. Given again: of one more plane")
      ->type_name("z=C|OX,OY,OZ,NX,NY,NZ")
      ->allow_extra_args(false)
      ->each([&flags](const std::string&) { flags.sequence.in_space = true; })
      ->group(kGroup);
  app.add_option("--isolines", flags.isolines,
                 "Beside the outline, on each slice, isolines of the density, which is about 1 "
                 "inside of bodies and .5 on their boundaries: a list of values in [.01, 10]")
      ->type_name("V,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->group(kGroup);
  app.add_option("--kernel-radius", flags.kernel_radius, "Kernel radius")
      ->type_name("R")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--cell-size", flags.cell_size, "Spacing of the lattice")
      ->type_name("C")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--reference-radius", flags.reference_radius,
                 "Reference radius of the level set; calibrated by default")
      ->type_name("A")
      ->group(kGroup);
  app.add_option("--surface-offset", flags.surface_offset,
                 "farthest-particle: move the outline outward")
      ->type_name("D")
      ->capture_default_str()
      ->group(kGroup);
  app.add_flag("--no-normal-memory", flags.no_normal_memory,
               "Orient normals without those of the frame before")
      ->group(kGroup);
  app.add_option("--clean", flags.clean,
                 "Drop tiny holes and components without a particle: on, off or auto")
      ->type_name("WHEN")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--min-area", flags.min_area,
                 "Drop spray: components of less area, in squared spacings")
      ->type_name("A")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--min-particles", flags.min_particles,
                 "Drop spray: components of fewer particles")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)  // Else "-1" is read as the largest number there is.
      ->capture_default_str()
      ->group(kGroup);
}

void AddOutputFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Output";
  std::string formats;
  for (const FrameFormat format : AllFrameFormats()) {
    AppendAll(formats, formats.empty() ? "" : ",", Name(format));
  }
  app.add_option("--output-dir", flags.output_dir, "Write DIR/frame_000000.EXT for every frame")
      ->type_name("DIR")
      ->group(kGroup);
  app.add_option("--format", flags.format, "Of these files, a list of " + formats)
      ->type_name("LIST")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option(
         "--color-by", flags.color_by,
         "Colour the pictures of svg and report by this one of --attributes; of a vector its "
         "length. Values are those at the vertices: --fill grid has most of them")
      ->type_name("NAME")
      ->group(kGroup);
  app.add_option("--stats", flags.stats, "Numbers of every frame, CSV or JSON by extension")
      ->type_name("FILE")
      ->group(kGroup);
  app.add_option("--report", flags.report, "One HTML page to look at, frame by frame")
      ->type_name("FILE.html")
      ->group(kGroup);
  app.add_flag("--check", flags.check, "Check every guarantee of every result")->group(kGroup);
  app.add_flag("--keep-going", flags.keep_going, "End well although frames were refused")
      ->group(kGroup);
  app.add_flag("--quiet", flags.quiet, "No progress and no table")->group(kGroup);
}

}  // namespace

CLI::App* AddReplay(CLI::App& app, ReplayFlags& flags) {
  CLI::App* verb = app.add_subcommand(
      "replay", "Reconstruct a recorded sequence through a server, or in this process");
  AddInputFlags(*verb, flags);
  AddPlaceFlags(*verb, flags);
  AddMethodFlags(*verb, flags);
  AddOutputFlags(*verb, flags);
  verb->parse_complete_callback([verb] {
    const absl::Status status = CheckCombinations(*verb);
    if (!status.ok()) throw CLI::ValidationError(OneLine(status), CLI::ExitCodes::ValidationError);
  });
  verb->footer(
      "Examples:\n"
      "  partiemc replay dam_break.pemc --local --report dam_break.html\n"
      "  partiemc replay frames/ --server 127.0.0.1:50051 --spacing 0.0303 "
      "--output-dir out --format geojson,svg\n"
      "  partiemc replay drum.lammpstrj.gz --select type=1 --stats drum.csv --check\n"
      "  partiemc replay 'run/part_*.csv' --columns 'Points:0,Points:2' --frames 100:200 "
      "--rate 25\n"
      "  partiemc replay dam_break.pemc --local --isolines .2,.5,.8 --report dam_break.html\n"
      "  partiemc replay dam_break.pemc --name dam --rate 25 --loop   and elsewhere: partiemc "
      "watch "
      "dam\n"
      "However it ends, --stats and --report have the frames that came through, and the report "
      "tells "
      "why\nit ended early.\n"
      "Exit codes: 0 good, 1 failed, 2 wrong usage, 3 input, 4 server, 130 interrupted.");
  return verb;
}

}  // namespace partiemc::client
