// The flags of `partiemc replay`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/frame_outputs.h"
#include "client/cli/server_flags.h"
#include "client/input/sequence.h"
#include "partiemc/parameters.h"

namespace CLI {
class App;
}

namespace partiemc::client {

/// The values of the flags. Some are still text, which ParametersOf parses.
struct ReplayFlags {
  std::string input;
  SequenceOptions sequence;

  ServerFlags server;
  bool local = false;
  std::uint32_t checkpoint_interval = 4;
  int threads = 0;  ///< 0: one for each processor.
  double deadline_seconds = 30;
  std::optional<double> give_up_after_seconds;  ///< Absent: kPatience; for latest kShortPatience.
  std::string name;                             ///< Stream name; empty: chosen by the server.
  bool echo_particles = false;

  std::string coordinates = "float64";
  bool surface = false;  ///< Surfaces in space instead of outlines.
  SurfaceOptions surface_options = {};
  std::string placement = "virtual-plane";
  std::string fill = "greedy";
  /// "z=0.5" or six numbers. The first slice is the plane of the frame's own outline. Each other
  /// slice, with `surface` each slice, is a section.
  std::vector<std::string> slices;
  std::string phases;            ///< "NAME=PHASE,...": the attribute and the phases.
  std::vector<double> isolines;  ///< Isovalues of the density.
  std::string periodic;          ///< Axes: "x,y"; empty: none.
  std::string box;               ///< "X0,X1,Y0,Y1[,Z0,Z1]"; empty: the box of the input.
  bool wrap = false;             ///< Results are wrapped into the periodic box.
  std::optional<double> noise_filter;
  std::vector<std::string> wall_planes;  ///< "x=0", "x=9,below": the walls of a surface.
  std::vector<std::string> walls;        ///< "X0,Y0,X1,Y1,...": points; "NAME=1,2": particles.
  std::string spacing;  ///< A number, "first-frame" or "every-frame"; empty: from the input.
  std::string sizes = "equal";
  std::string boundary = "bulk";
  double kernel_radius = 3;
  double cell_size = 1;
  std::optional<double> reference_radius;
  double surface_offset = 0;
  double attribute_tolerance = 0.01;
  bool no_normal_memory = false;
  std::string clean = "auto";
  double min_area = 0;
  std::uint64_t min_particles = 0;

  std::string rate = "max";
  std::string policy = "block";
  bool loop = false;
  bool check = false;
  bool keep_going = false;
  bool quiet = false;

  FrameOutputs::Places files;  ///< The members `surface` and `walls` are not set here.
  std::string report;
  std::uint64_t report_particles = 20'000;
};

/// Adds the verb to `app`; its flags go to `flags`, which must outlive the parsing.
CLI::App* AddReplay(CLI::App& app, ReplayFlags& flags);

}  // namespace partiemc::client
