#include "client/cli/replay_flags.h"

#include <string>
#include <utility>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/input_source.h"
#include "client/output/frame_writer.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

absl::Status CheckCombinations(const CLI::App& app, const ReplayFlags& flags) {
  if (app.count("--threads") > 0 && app.count("--local") == 0) {
    return absl::InvalidArgumentError("--threads: requires --local; a server has its own threads");
  }
  if (app.count("--format") > 0 && app.count("--output-dir") == 0) {
    return absl::InvalidArgumentError("--format: requires --output-dir");
  }
  if (app.count("--surface") > 0 && app.count("--gauge") > 0) {
    return absl::InvalidArgumentError(
        "--gauge: measures outlines, so it cannot be combined with --surface; --stats has the "
        "areas and volumes of surfaces");
  }
  if (app.count("--surface") > 0 && app.count("--slice") == 0) {
    for (const auto& [flag, instead] :
         {std::pair("--min-area", "; --min-volume drops small bodies"), std::pair("--fill", "")}) {
      if (app.count(flag) == 0) continue;
      return absl::InvalidArgumentError(
          Concat(flag, ": is for outlines, so --surface requires --slice with it", instead));
    }
  }
  if (flags.boundary == "grains" && app.count("--sizes") > 0 && flags.sizes != "own") {
    return absl::InvalidArgumentError(
        "--sizes: must be own, or absent, with --boundary grains: grains have own sizes");
  }
  if (app.count("--check") > 0 && app.count("--coordinates") > 0) {
    return absl::InvalidArgumentError("--check: requires --coordinates float64, the default");
  }
  if (app.count("--color-by") > 0 &&
      (app.count("--attributes") == 0 ||
       (app.count("--output-dir") == 0 && app.count("--report") == 0))) {
    return absl::InvalidArgumentError(
        "--color-by: requires --attributes with this name, and --output-dir or --report");
  }
  if (app.count("--loop") > 0) {
    for (const char* output : {"--output-dir", "--stats", "--report"}) {
      if (app.count(output) > 0) {
        return absl::InvalidArgumentError(
            Concat("--loop: cannot be combined with ", output, ", because a loop has no end"));
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
  app.add_option("--columns", flags.sequence.columns,
                 "Columns of the positions: x,y or 2,3; of HDF5 datasets: GROUP/x,GROUP/y")
      ->type_name("NAMES")
      ->group(kGroup);
  AddAttributesFlag(
      app, flags.sequence,
      "Particle attributes to interpolate to the vertices: column names, arrays of two or three "
      "components, or velocity")
      ->group(kGroup);
  for (CLI::Option* const flag : AddTimeFlags(app, flags.sequence)) flag->group(kGroup);
  app.add_option("--frames", flags.sequence.frames, "Frames A to B - 1, counted from 0: A:B")
      ->type_name("A:B")
      ->group(kGroup);
  AddExpansionFlag(app, flags.sequence)->group(kGroup);
  app.add_option("--rate", flags.rate, "Frames per second to send at, or max")
      ->type_name("FPS")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--policy", flags.policy,
                 "What to do with frames while the server is busy: block (wait, no frame is lost) "
                 "or latest "
                 "(send the newest, skip and count the others)")
      ->check(CLI::IsMember({"block", "latest"}))
      ->type_name("WHICH")
      ->capture_default_str()
      ->group(kGroup);
  app.add_flag("--loop", flags.loop,
               "Start over when the input ends, until Ctrl-C; for watchers, writes no files")
      ->group(kGroup);
}

void AddPlaceFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Server";
  CLI::Option* const server = AddServerFlags(app, flags.server, kGroup);
  server->description("Server address, HOST:PORT or unix:PATH. Give several to fail over")
      ->multi_option_policy(CLI::MultiOptionPolicy::Join)
      ->delimiter(',');
  app.add_option("--checkpoint-interval", flags.checkpoint_interval,
                 "Request a checkpoint with every K-th frame, to resume from after a lost "
                 "connection; 0: none, "
                 "a lost connection ends the replay")
      ->type_name("K")
      ->check(CLI::Range(0u, 1'000'000u))
      ->capture_default_str()
      ->group(kGroup);
  CLI::Option* const name =
      app.add_option("--name", flags.name, "Stream name, for `partiemc watch NAME`")
          ->type_name("NAME")
          ->group(kGroup);
  CLI::Option* const echo =
      app.add_flag("--echo-particles", flags.echo_particles, "Send the particles to watchers too")
          ->group(kGroup);
  CLI::Option* const coordinates = AddCoordinatesFlag(app, flags.coordinates)->group(kGroup);
  app.add_flag("--local", flags.local, "Reconstruct in this process, without a server")
      ->excludes(server)
      ->excludes(name)
      ->excludes(echo)
      ->excludes(coordinates)
      ->group(kGroup);
  app.add_option("--threads", flags.threads,
                 "Number of threads with --local (default: one per processor)")
      ->check(CLI::Range(1, 1024))
      ->group(kGroup);
  app.add_option("--deadline", flags.deadline_seconds, "Timeout of a response, in seconds")
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

void AddSurfaceFlags(CLI::App& app, ReplayFlags& flags, const char* group) {
  CLI::Option* const surface =
      app.add_flag("--surface", flags.surface,
                   "Closed surfaces of 3D particles instead of outlines. Each --slice adds the "
                   "outline on a plane")
          ->each([&flags](const std::string&) { flags.sequence.in_space = true; })
          ->group(group);
  app.add_option("--thinning-distance", flags.surface_options.thinning_distance,
                 "Surfaces: drop vertices that are at most this far from the triangles without "
                 "them; 0: none")
      ->type_name("D")
      ->capture_default_str()
      ->needs(surface)
      ->group(group);
  app.add_option("--simplify", flags.surface_options.simplify,
                 "Surfaces: fewer triangles, within this error; .05 leaves a third of those of "
                 "large bodies")
      ->type_name("D")
      ->capture_default_str()
      ->needs(surface)
      ->group(group);
  app.add_option("--max-drop-particles", flags.surface_options.max_drop_particles,
                 "Surfaces: bodies of up to this many particles become ellipsoids; 0: none")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->needs(surface)
      ->group(group);
  app.add_option("--min-volume", flags.surface_options.min_component_volume,
                 "Surfaces: drop bodies whose particles have less volume, in cubed spacings")
      ->type_name("V")
      ->capture_default_str()
      ->needs(surface)
      ->group(group);
}

void AddMethodFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Method (lengths in spacings)";
  app.add_option("--placement", flags.placement,
                 "marching-squares (marching cubes with --surface), qef, farthest-particle or "
                 "virtual-plane")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--fill", flags.fill, "greedy, conforming, polygon, grid or none")
      ->type_name("NAME")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option(
         "--spacing", flags.spacing,
         "Particle spacing in world units; first-frame or every-frame estimate it (slices and "
         "surfaces: first-frame). Default: the spacing of the recording, else first-frame")
      ->type_name("S|RULE")
      ->group(kGroup);
  app.add_option(
         "--sizes", flags.sizes,
         "Sizes of the particles: equal, or own, from the column volume, diameter or radius")
      ->type_name("WHICH")
      ->each([&flags](const std::string& sizes) { flags.sequence.needs_sizes = sizes == "own"; })
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--boundary", flags.boundary,
                 "What the outline runs around: bulk, or grains, discs of the column diameter or "
                 "radius, else of the area in the column volume; grains have own sizes")
      ->type_name("WHICH")
      ->each([&flags](const std::string& boundary) {
        flags.sequence.needs_diameters = boundary == "grains";
      })
      ->capture_default_str()
      ->group(kGroup);
  AddSurfaceFlags(app, flags, kGroup);
  CLI::Option* const periodic =
      app.add_option(
             "--periodic", flags.periodic,
             "Periodic axes of the results: a body that crosses the box is one body, and an "
             "outline or a surface that reaches its own image is cut at the box. Each frame has "
             "the box of the LAMMPS dump or extended XYZ, or --box")
          ->type_name("x,y,z")
          ->group(kGroup);
  app.add_option("--box", flags.box, "Bounds of the periodic box in world units")
      ->type_name("X0,X1,Y0,Y1[,Z0,Z1]")
      ->needs(periodic)
      ->group(kGroup);
  app.add_flag("--wrap", flags.wrap, "Cut all outlines and surfaces at the periodic box")
      ->needs(periodic)
      ->group(kGroup);
  app.add_option("--noise-filter", flags.noise_filter,
                 "Filter noise of positions from frame to frame: weight, in (0, 1], of the given "
                 "positions; .5 is a good value. Requires particle ids")
      ->type_name("W")
      ->group(kGroup);
  app.add_option(
         "--wall", flags.walls,
         "Wall at which the outline is cut, by its points in world units, with the fluid on "
         "its left. Two points: an endless line; 0,0,1,0 is the floor y = 0. More points: a "
         "closed polygon, a tank if counter-clockwise, an obstacle if clockwise. With --periodic, "
         "lines are parallel to the periodic axis, and polygons are obstacles. Or the particles of "
         "walls, by an attribute: type=2. Repeat for more walls")
      ->type_name("X0,Y0,X1,Y1,...|NAME=N,...")
      ->allow_extra_args(false)
      ->group(kGroup);
  app.add_option(
         "--wall-plane", flags.wall_planes,
         "Wall at which a surface is cut, by the coordinate that is constant on it, in world "
         "units. z=0 is a floor, with the fluid above it; z=5,below is a ceiling, with the "
         "fluid below it. Repeat for more walls, one for each side of each axis")
      ->type_name("AXIS=POSITION[,below]")
      ->allow_extra_args(false)
      ->group(kGroup);
  app.add_option(
         "--slice", flags.slices,
         "Plane to cut 3D particles with: x=C, y=C, z=C, or a point and a normal. Repeat for "
         "more planes")
      ->type_name("z=C|OX,OY,OZ,NX,NY,NZ")
      ->allow_extra_args(false)
      ->each([&flags](const std::string&) { flags.sequence.in_space = true; })
      ->group(kGroup);
  app.add_option("--phases", flags.phases,
                 "Outlines of phases that share their interfaces: the particle attribute with the "
                 "phase, and its whole numbers, such as type=1,2")
      ->type_name("NAME=PHASE,...")
      ->group(kGroup);
  app.add_option("--isolines", flags.isolines,
                 "Isovalues of the density in [.01, 10], drawn beside the outline on each slice; "
                 "the density "
                 "is about 1 inside bodies and .5 at their boundaries")
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
  app.add_option(
         "--attribute-tolerance", flags.attribute_tolerance,
         "Largest error of attributes across triangles of greedy, a fraction of their range")
      ->type_name("T")
      ->capture_default_str()
      ->group(kGroup);
  app.add_flag("--no-normal-memory", flags.no_normal_memory,
               "Orient normals without the normals of the previous frame")
      ->group(kGroup);
  app.add_option("--clean", flags.clean,
                 "Drop tiny holes and components without particles: on, off or auto")
      ->type_name("WHEN")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--min-area", flags.min_area,
                 "Drop spray: components smaller than this area, in squared spacings")
      ->type_name("A")
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--min-particles", flags.min_particles,
                 "Drop spray: components with fewer particles")
      ->type_name("N")
      ->check(CLI::NonNegativeNumber)  // CLI11 would read "-1" as the largest unsigned number.
      ->capture_default_str()
      ->group(kGroup);
}

void AddOutputFlags(CLI::App& app, ReplayFlags& flags) {
  constexpr const char* kGroup = "Output";
  app.add_option("--output-dir", flags.files.output_dir,
                 "Write DIR/frame_000000.EXT for every frame")
      ->type_name("DIR")
      ->group(kGroup);
  app.add_option("--format", flags.files.format,
                 "Formats of these files, from " + Names(AllFrameFormats()) +
                     " (default: geojson; with --surface ply)")
      ->type_name("LIST")
      ->group(kGroup);
  AddCompressGlbFlag(app, flags.files.compress_glb)->group(kGroup);
  app.add_option("--color-by", flags.files.color_by,
                 "Attribute that colours the pictures of svg and report; a vector by its length. "
                 "The values are taken at the vertices: --fill grid has the most")
      ->type_name("NAME")
      ->group(kGroup);
  AddStatisticsFlags(app, flags.files, kGroup);
  CLI::Option* const report =
      app.add_option("--report", flags.report, "HTML page that shows every frame")
          ->type_name("FILE.html")
          ->group(kGroup);
  app.add_option("--report-particles", flags.report_particles,
                 "Maximum number of particles per frame in the report, selected evenly; 0: none")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber)
      ->needs(report)
      ->group(kGroup);
  app.add_flag("--check", flags.check, "Check every result against the guarantees")->group(kGroup);
  app.add_flag("--keep-going", flags.keep_going, "Exit with 0 even if frames were refused")
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
  verb->parse_complete_callback([verb, &flags] {
    const absl::Status status = CheckCombinations(*verb, flags);
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
      "  partiemc replay dam_break.pemc --local --stats dam.csv --gauge front=front:1,0 "
      "--gauge level=height:0.5\n"
      "  partiemc replay splash.vtu --local --surface --spacing 0.05 --output-dir out "
      "--format ply,vtp\n"
      "  partiemc replay splash.vtu --local --surface --spacing 0.05 --report splash.html\n"
      "  partiemc replay colliding_drops.pemc --surface --name drops --coordinates compact\n"
      "  partiemc replay dam_break.pemc --local --isolines .2,.5,.8 --report dam_break.html\n"
      "  partiemc replay dam_break.pemc --name dam --rate 25 --loop   and elsewhere: partiemc "
      "watch "
      "dam\n"
      "If the replay ends early, --stats and --report hold the frames received so far, and the\n"
      "report states the reason.\n"
      "Exit codes: 0 good, 1 failed, 2 wrong usage, 3 input, 4 server, 130 interrupted.");
  return verb;
}

}  // namespace partiemc::client
