#include "architecture/rules.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <regex>
#include <sstream>
#include <utility>

#include "partiemc/stage.h"

namespace partiemc::architecture {
namespace {

// A header of gRPC or Protobuf, or one that protoc has made.
bool IsMessage(std::string_view include) {
  return include.starts_with("google/protobuf/") || include.ends_with(".pb.h");
}

bool IsMessageOrItsBytes(std::string_view include) {
  return IsMessage(include) || include == "grpcpp/support/byte_buffer.h";
}

bool IsMessaging(std::string_view include) {
  return include.starts_with("grpc") || IsMessage(include);
}

// The room of the headers that are installed.
constexpr std::string_view kPublicHeaders = "include";

// The name of a file without folder and ending: a header and its source have the same.
std::string Stem(const std::string& path) {
  static const std::regex kEnding(R"((-inl)?\.(h|cc)$)");
  return std::regex_replace(path.substr(path.rfind('/') + 1), kEnding, std::string());
}

std::string StageFile(Stage stage, std::string_view extension) {
  const std::string name(Name(stage));
  return "core/src/" + name + "/" + name + std::string(extension);
}

void RequireFile(const SourceTree& tree, const std::string& path, Violations& violations) {
  if (!tree.contains(path)) violations.push_back(path + ": is missing");
}

std::vector<std::string> Matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> matches;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    matches.push_back((*match)[1]);
  }
  return matches;
}

// The packages of docker/packages/<set>.txt and of the sets that it includes by '@'.
std::set<std::string> PackageSet(const SourceTree& tree, const std::string& set) {
  std::set<std::string> packages;
  const auto file = tree.find("docker/packages/" + set + ".txt");
  if (file == tree.end()) return packages;
  std::istringstream lines(file->second);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string word;
    if (!(words >> word)) continue;
    if (word.starts_with('@')) {
      packages.merge(PackageSet(tree, word.substr(1)));
    } else {
      packages.insert(word);
    }
  }
  return packages;
}

// What find_package, pkg_check_modules and find_library ask for, and the Debian packages that
// have it. Nothing for what comes with the compiler or is the project itself.
const std::map<std::string, std::vector<std::string>>& PackagesByName() {
  static const std::map<std::string, std::vector<std::string>> packages = {
      {"absl", {"libabsl-dev"}},
      {"benchmark", {"libbenchmark-dev"}},
      {"Boost", {"libboost-dev"}},
      {"CLI11", {"libcli11-dev"}},
      {"gRPC", {"libgrpc++-dev", "protobuf-compiler-grpc"}},
      {"GTest", {"libgtest-dev", "libgmock-dev"}},
      {"lammps", {"liblammps-dev"}},
      {"libzstd", {"libzstd-dev"}},  // The name that pkg-config knows it by.
      {"nlohmann_json", {"nlohmann-json3-dev"}},
      {"partiemc", {}},
      {"PkgConfig", {"pkg-config"}},
      {"OpenSSL", {"libssl-dev"}},
      {"nats", {"libnats-dev"}},
      {"prometheus-cpp", {"prometheus-cpp-dev"}},
      {"pybind11", {"pybind11-dev"}},
      {"Python3", {"python3-dev"}},
      {"Protobuf", {"libprotobuf-dev", "protobuf-compiler"}},
      {"spdlog", {"libspdlog-dev"}},
      {"TBB", {"libtbb-dev"}},
      {"hwy", {"libhwy-dev"}},
      {"Threads", {}},
      {"VTK", {"libvtk9-dev"}},
      {"ZLIB", {"zlib1g-dev"}},
      {"zstd", {"libzstd-dev"}},
  };
  return packages;
}

// The names that a CMake file looks for.
std::vector<std::string> LookedFor(const std::string& cmake) {
  static const std::regex kComment("#[^\n]*");
  static const std::regex kFindPackage(R"(find_package\(\s*([A-Za-z0-9_+-]+))");
  static const std::regex kLibrary(R"(find_library\(\s*\w+\s+(?:NAMES\s+)?([\w.+-]+))");
  static const std::regex kModule(R"(pkg_(?:check_modules|search_module)\(([^)]*)\))");
  static const std::set<std::string> kOptions = {"REQUIRED", "QUIET", "IMPORTED_TARGET", "GLOBAL"};
  const std::string code = std::regex_replace(cmake, kComment, "");
  std::vector<std::string> names = Matches(code, kFindPackage);
  std::ranges::move(Matches(code, kLibrary), std::back_inserter(names));
  for (const std::string& arguments : Matches(code, kModule)) {
    std::istringstream words(arguments);
    std::string word;
    words >> word;  // The prefix of the variables.
    while (words >> word) {
      if (!kOptions.contains(word)) names.push_back(word.substr(0, word.find_first_of("<>=")));
    }
  }
  return names;
}

}  // namespace

Violations CoreIsPlain(const SourceTree& tree) {
  static const std::regex kForbiddenHeader(
      "(grpc|google/protobuf/|spdlog/|fmt/|CLI/|sys/|unistd|fcntl).*|.*\\.pb\\.h|"
      "(fstream|iostream|cstdio|stdio\\.h|filesystem|chrono|ctime|time\\.h|cstdlib|thread|random)");
  static const std::regex kForbiddenName(
      R"(\b(getenv|fopen|f?printf|system_clock|steady_clock|random_device)\b)");
  Violations violations;
  for (const auto& [path, text] : tree) {
    if (Room(path) != "core" || !IsCxx(path)) continue;
    for (const std::string& include : Includes(text)) {
      const std::string target = ResolveInclude(tree, path, include);
      if (std::regex_match(include, kForbiddenHeader) ||
          (!target.empty() && Room(target) != "core")) {
        violations.push_back(path + ": includes " + include + "; the core is plain C++");
      }
    }
    for (const std::string& name :
         Matches(WithoutComments(text, Literals::kBlank), kForbiddenName)) {
      violations.push_back(path + ": uses " + name + "; the core has no files, clock, environment");
    }
  }
  return violations;
}

Violations TasksStartInOneFile(const SourceTree& tree) {
  static const std::string kDoor = "core/src/base/parallel.cc";
  static const std::regex kTasks("(oneapi/)?tbb/(?!global_control\\.h).*");
  Violations violations;
  RequireFile(tree, kDoor, violations);
  for (const auto& [path, text] : tree) {
    if (Room(path) == "tests" || !IsCxx(path) || path == kDoor) continue;
    for (const std::string& include : Includes(text)) {
      if (std::regex_match(include, kTasks)) {
        violations.push_back(path + ": includes " + include +
                             "; tasks go through parallel.h or partiemc/arena.h");
      }
    }
  }
  return violations;
}

Violations FilesKeepTheirRooms(const SourceTree& tree) {
  struct House {
    std::string folder;
    std::string include_root;        ///< What includes begin after.
    std::vector<std::string> rooms;  ///< A file includes its own and those before it.
    std::set<std::string> beside;    ///< Stems that lie in no room and may include all of them.
  };
  static const std::array<House, 4> kHouses = {
      {{"core/src/",
        "core/src/",
        {"base", "frame", "state", "bins", "field", "crossings", "rings", "sampler", "normals",
         "vertices", "identities", "mesh", "attributes", "check"},
        {"frame_lengths", "reconstructor", "workspace", "workspace_bytes"}},
       {"server/",
        "",
        {"base", "telemetry", "security", "connections", "compute", "watch", "stream", "relay",
         "calls", "web", "rpc"},
        {"main", "options", "server"}},
       {"client/",
        "",
        {std::string(kPublicHeaders), "library", "c", "python", "output", "input", "recording",
         "cli", "couplings"},
        {}},
       {"client/input/",
        "",
        {"base", "formats"},
        {"file_list", "frame_range", "natural_order", "plane", "sequence", "times"}}}};
  Violations violations;
  for (const House& house : kHouses) {
    const auto room_of = [&](const std::string& path) {
      const std::string rest = path.substr(house.folder.size());
      const auto slash = rest.find('/');
      return slash == std::string::npos ? std::string() : rest.substr(0, slash);
    };
    for (const auto& [path, text] : tree) {
      if (!path.starts_with(house.folder) || !IsCxx(path)) continue;
      const std::string room = room_of(path);
      const auto place = std::ranges::find(house.rooms, room);
      if (room.empty() ? !house.beside.contains(Stem(path)) : place == house.rooms.end()) {
        violations.push_back(path + ": lies in no room");
        continue;
      }
      for (const std::string& include : Includes(text)) {
        const std::string target = ResolveInclude(tree, path, include);
        if (!target.starts_with(house.folder)) continue;
        // What programs of others include too is called as they call it.
        const bool is_public = room_of(target) == kPublicHeaders;
        if (!is_public && target != house.include_root + include) {
          violations.push_back(path + ": includes " + include + " without its room");
        } else if (!room.empty() && std::ranges::find(house.rooms, room_of(target)) > place) {
          violations.push_back(path + ": includes " + include + ", of a room below its own");
        }
      }
    }
  }
  return violations;
}

Violations NoFolderIsTooFull(const SourceTree& tree) {
  constexpr std::size_t kMostStems = 18;
  static constexpr std::array<std::string_view, 4> kRooms = {"client", "core", "proto", "server"};
  std::map<std::string, std::set<std::string>> stems;
  for (const auto& [path, text] : tree) {
    if (IsCxx(path) && std::ranges::count(kRooms, Room(path)) > 0) {
      stems[path.substr(0, path.rfind('/'))].insert(Stem(path));
    }
  }
  Violations violations;
  for (const auto& [folder, names] : stems) {
    if (names.size() > kMostStems) {
      violations.push_back(folder + ": has " + std::to_string(names.size()) + " stems");
    }
  }
  return violations;
}

Violations GrpcStaysInItsRooms(const SourceTree& tree) {
  static const std::regex kMayInclude(
      "server/(rpc|security)/.*|server/(server|main)\\..*|server/telemetry/logging\\.cc");
  Violations violations;
  for (const auto& [path, text] : tree) {
    if (!path.starts_with("server/") || !IsCxx(path) || std::regex_match(path, kMayInclude)) {
      continue;
    }
    for (const std::string& include : Includes(text)) {
      const bool carries = path.starts_with("server/calls/") || path.starts_with("server/web/") ||
                           path.starts_with("server/relay/");
      if (carries && IsMessageOrItsBytes(include)) continue;
      if (IsMessaging(include)) violations.push_back(path + ": includes " + include);
    }
  }
  return violations;
}

Violations StagesKeepTheirOrder(const SourceTree& tree) {
  static const std::string kReconstructor = "core/src/reconstructor.cc";
  static const std::string kLastStage = StageFile(static_cast<Stage>(kStageCount - 1), ".cc");
  Violations violations;
  RequireFile(tree, kReconstructor, violations);
  std::vector<std::string> headers;
  for (std::size_t k = 0; k < kStageCount; ++k) {
    headers.push_back(StageFile(static_cast<Stage>(k), ".h"));
    RequireFile(tree, headers.back(), violations);
    RequireFile(tree, StageFile(static_cast<Stage>(k), ".cc"), violations);
  }
  if (!violations.empty()) return violations;

  for (std::size_t k = 0; k < kStageCount; ++k) {
    for (const char* extension : {".h", ".cc"}) {
      const std::string file = StageFile(static_cast<Stage>(k), extension);
      const Reached reached = Reach(tree, file);
      for (std::size_t later = k + 1; later < kStageCount; ++later) {
        if (reached.ours.contains(headers[later])) {
          violations.push_back(file + ": reaches the later stage " + headers[later]);
        }
      }
    }
  }
  for (const auto& [path, text] : tree) {
    // The last stage may know all of the others: that is no knowledge of their order.
    if (Room(path) != "core" || !path.ends_with(".cc") || path == kLastStage) continue;
    const Reached reached = Reach(tree, path);
    const bool all =
        std::ranges::all_of(headers, [&](const auto& h) { return reached.ours.contains(h); });
    if (all != (path == kReconstructor)) {
      violations.push_back(path + ": " + (all ? "reaches" : "does not reach") +
                           " all stages; reconstructor.cc alone knows their order");
    }
  }
  return violations;
}

Violations SessionsAreFreeOfGrpc(const SourceTree& tree) {
  static const std::regex kLibrary(R"(add_library\(\s*partiemc_server_session\s+STATIC([^)]*)\))");
  Violations violations;
  const auto cmake = tree.find("server/CMakeLists.txt");
  const auto lists =
      cmake == tree.end() ? std::vector<std::string>{} : Matches(cmake->second, kLibrary);
  if (lists.size() != 1) return {"server/CMakeLists.txt: has not one partiemc_server_session"};
  std::istringstream words(lists.front());
  for (std::string word; words >> word;) {
    const std::string stem = "server/" + word.substr(0, word.rfind('.'));
    RequireFile(tree, stem + ".cc", violations);
    for (const std::string& path : {stem + ".h", stem + ".cc"}) {
      if (!tree.contains(path)) continue;
      for (const std::string& include : Reach(tree, path).foreign) {
        if (IsMessaging(include)) violations.push_back(path + ": reaches " + include);
      }
    }
  }
  return violations;
}

Violations ServerAndClientAreStrangers(const SourceTree& tree) {
  static const std::array<std::pair<std::string_view, std::string>, 2> kStrangers = {
      {{"server", "client"}, {"client", "server"}}};
  static const std::regex kLinked(R"(\bpartiemc(?:::|_)(server|client)\w*)");
  Violations violations;
  for (const auto& [path, text] : tree) {
    for (const auto& [room, stranger] : kStrangers) {
      if (Room(path) != room) continue;
      if (IsCxx(path)) {
        for (const std::string& file : Reach(tree, path).ours) {
          if (Room(file) == stranger) violations.push_back(path + ": reaches " + file);
        }
      } else if (path.ends_with("CMakeLists.txt")) {
        const auto linked = Matches(text, kLinked);
        if (std::ranges::find(linked, stranger) != linked.end()) {
          violations.push_back(path + ": links to the " + stranger);
        }
      }
    }
  }
  return violations;
}

Violations NoMachinePaths(const SourceTree& tree) {
  // Not preceded by what makes it the tail of a relative path, of a variable or of an address.
  static const std::regex kMachinePath(
      R"re((?:^|[^\w.~/})*-])(/(?:home|Users|work|mnt|root|media)/[\w.]+))re");
  Violations violations;
  for (const auto& [path, text] : tree) {
    for (const std::string& found : Matches(text, kMachinePath)) {
      violations.push_back(path + ": names " + found);
    }
  }
  return violations;
}

Violations PackageSetsAreComplete(const SourceTree& tree) {
  Violations violations;
  for (const auto& [path, text] : tree) {
    if (!path.ends_with("CMakeLists.txt") && !path.ends_with(".cmake")) continue;
    for (const std::string& name : LookedFor(text)) {
      const auto packages = PackagesByName().find(name);
      if (packages == PackagesByName().end()) {
        violations.push_back(path + ": looks for " + name + ", which no package is known for");
        continue;
      }
      const std::string set = Room(path) == "core"    ? "core"
                              : Room(path) == "tests" ? "tests"
                              : name == "VTK"         ? "vtk"
                              : name == "pybind11"    ? "python"
                              : name == "Python3"     ? "python"
                                                      : "service";
      const auto listed = PackageSet(tree, set);
      for (const std::string& package : packages->second) {
        if (!listed.contains(package)) {
          violations.push_back("docker/packages/" + set + ".txt: lacks " + package + ", as " +
                               path + " looks for " + name);
        }
      }
    }
  }
  return violations;
}

}  // namespace partiemc::architecture
