// `partiemc`: the command line. Connects flags with verbs.
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/cli/console.h"
#include "client/cli/convert.h"
#include "client/cli/info.h"
#include "client/cli/load/load.h"
#include "client/cli/replay/replay.h"
#include "client/cli/replay_flags.h"
#include "client/cli/streams.h"
#include "client/cli/watch.h"

namespace {

using partiemc::client::Complain;

bool IsFlagOfSplashsurf(std::string_view flag) {
  constexpr std::string_view kShort[] = {"-a", "-c", "-d", "-e", "-l",
                                         "-n", "-o", "-r", "-s", "-t"};
  constexpr std::string_view kLong[] = {
      "--particle-", "--smoothing-length", "--cube-size",   "--surface-threshold",
      "--mesh-",     "--normals",          "--sph-normals", "--output-file"};
  return std::ranges::count(kShort, flag) > 0 ||
         std::ranges::any_of(kLong, [&](std::string_view name) { return flag.starts_with(name); });
}

// Returns a message that lists the arguments that no verb and no flag takes.
std::string Unexpected(const CLI::App& app) {
  std::string text;
  bool is_of_splashsurf = false;
  for (const std::string& argument : app.remaining(/*recurse=*/true)) {
    text += (text.empty() ? "" : " ") + argument;
    is_of_splashsurf |= IsFlagOfSplashsurf(argument);
  }
  text += ": not expected";
  if (is_of_splashsurf) {
    text += "; core/SURFACES.md has the counterparts of splashsurf's flags";
  }
  return text;
}

// Reports a wrong verb or flag and refers to the help of its verb. `first`: the first argument.
int ComplainUsage(const CLI::App& app, const CLI::ParseError& error, std::string_view first) {
  std::string help = "partiemc", wrong = error.what();
  const std::vector<CLI::App*> given = app.get_subcommands();
  if (given.empty() && !first.empty() && !first.starts_with('-')) {
    wrong = "'" + std::string(first) + "'; must be a verb:";
    for (const CLI::App* verb : app.get_subcommands(/*filter=*/{})) {
      wrong += (wrong.ends_with(':') ? " " : ", ") + verb->get_name();
    }
  }
  const bool is_unexpected = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  if (is_unexpected && !given.empty()) wrong = Unexpected(app);
  for (const CLI::App* verb : given) help += " " + verb->get_name();
  return Complain(partiemc::client::kUsage, wrong + "; see `" + help + " --help`");
}

int Run(int argc, char** argv) {
  CLI::App app("Outlines and surfaces of particle frames (SPH, granular), stable over time.",
               "partiemc");
  app.set_version_flag("--version", "partiemc " PARTIEMC_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(32);
  app.footer("`partiemc VERB --help` shows the options of a verb and examples.");
  partiemc::client::ReplayFlags replay;
  partiemc::client::WatchFlags watch;
  partiemc::client::QueryFlags streams;
  partiemc::client::QueryFlags info;
  partiemc::client::LoadFlags load;
  partiemc::client::ConvertFlags convert;
  const CLI::App* replay_verb = AddReplay(app, replay);
  const CLI::App* watch_verb = AddWatch(app, watch);
  const CLI::App* streams_verb = AddStreams(app, streams);
  const CLI::App* info_verb = AddInfo(app, info);
  const CLI::App* load_verb = AddLoad(app, load);
  AddConvert(app, convert);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return ComplainUsage(app, error, argc > 1 ? argv[1] : "");
  }
  if (replay_verb->parsed()) return Replay(replay);
  if (watch_verb->parsed()) return Watch(watch);
  if (streams_verb->parsed()) return Streams(streams);
  if (info_verb->parsed()) return Info(info);
  if (load_verb->parsed()) return Load(load);
  return Convert(convert);
}

}  // namespace

int main(int argc, char** argv) {
  // Disables gRPC's log lines, which are for its developers. This program reports connection errors
  // itself.
  setenv("GRPC_VERBOSITY", "NONE", /*replace=*/0);
  // A write above the limit of file sizes then fails, and temporary files are removed.
  std::signal(SIGXFSZ, SIG_IGN);
  return partiemc::client::EndOutput(Run(argc, argv));
}
