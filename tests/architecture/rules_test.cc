#include "architecture/rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <string>

namespace partiemc::architecture {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const SourceTree& Project() {
  static const SourceTree tree = ReadSourceTree(PARTIEMC_SOURCE_DIR);
  return tree;
}

// The project with `text` added to the end of one of its files (or as a new file).
SourceTree Planted(const std::string& path, const std::string& text) {
  SourceTree tree = Project();
  tree[path] += text;
  return tree;
}

SourceTree Without(const std::string& path, const std::string& text) {
  SourceTree tree = Project();
  std::string& content = tree.at(path);
  const auto at = content.find(text);
  EXPECT_NE(at, std::string::npos) << path << " does not hold " << text;
  content.erase(at, text.size());
  return tree;
}

TEST(SourceTree, HoldsTheProjectAndNoBuild) {
  EXPECT_TRUE(Project().contains("core/include/partiemc/partiemc.h"));
  EXPECT_TRUE(Project().contains("docker/packages/core.txt"));
  for (const auto& [path, text] : Project()) {
    EXPECT_FALSE(path.starts_with("build/") || path.starts_with(".git/")) << path;
  }
}

TEST(SourceTree, CommentsAreBlankedAndLiteralsOnlyOnRequest) {
  const std::string text = "a /* \" */ \"// b\" 1'000 'c' // d\ne";
  EXPECT_EQ(WithoutComments(text, Literals::kKeep), "a         \"// b\" 1'000 'c'     \ne");
  EXPECT_EQ(WithoutComments(text, Literals::kBlank), "a         \"    \" 1'000 ' '     \ne");
}

TEST(SourceTree, AnIncludeInACommentIsNone) {
  EXPECT_THAT(Includes("// x\n#include <a>\n/*\n#include <b>\n*/\n #  include \"c/d.h\"\n"),
              testing::ElementsAre("a", "c/d.h"));
}

TEST(SourceTree, AnIncludeMeansTheNearestFile) {
  const SourceTree tree = {
      {"core/src/a.h", ""},
      {"server/a.h", ""},
      {"server/x/b.cc", "#include \"a.h\"\n"},
      {"client/b.cc", "#include \"src/a.h\"\n#include <vector>\n"},
  };
  const IncludeGraph graph(tree);
  EXPECT_EQ(graph.Of("server/x/b.cc").at(0).file, "server/a.h");
  EXPECT_EQ(graph.Of("client/b.cc").at(0).file, "core/src/a.h");
  EXPECT_EQ(graph.Of("client/b.cc").at(1).file, "");
  EXPECT_THAT(graph.Reach("client/b.cc").foreign, testing::ElementsAre("vector"));
}

TEST(Architecture, TheCoreIsPlain) { EXPECT_THAT(CoreIsPlain(Project()), IsEmpty()); }

TEST(Architecture, AForeignHeaderInTheCoreIsSeen) {
  for (const std::string header :
       {"<grpcpp/grpcpp.h>", "<spdlog/spdlog.h>", "<fstream>", "<iostream>", "<chrono>",
        "\"partiemc/v1/reconstruction.pb.h\"", "\"wire/codec.h\""}) {
    const SourceTree tree = Planted("core/src/base/status.cc", "\n#include " + header + "\n");
    EXPECT_THAT(CoreIsPlain(tree), Contains(HasSubstr("core/src/base/status.cc"))) << header;
  }
}

TEST(Architecture, TheEnvironmentReadInTheCoreIsSeen) {
  const SourceTree tree = Planted("core/src/base/status.cc", "\nauto x = std::getenv(\"X\");\n");
  EXPECT_THAT(CoreIsPlain(tree), Contains(HasSubstr("uses getenv")));
}

TEST(Architecture, TheMathOfTheCoreIsExact) { EXPECT_THAT(CoreMathIsExact(Project()), IsEmpty()); }

TEST(Architecture, AnInexactFunctionInTheCoreIsSeen) {
  const std::string path = "core/src/base/status.cc";
  for (const std::string name : {"std::cbrt", "pow", "std::log2", "::sinf", "std::fma"}) {
    const SourceTree tree = {{path, "auto x = " + name + "(2.0);\n"}};
    EXPECT_THAT(CoreMathIsExact(tree), Contains(HasSubstr(path))) << name;
  }
  const SourceTree exact = {{path, "auto x = std::sqrt(CubeRoot(2));\n"}};
  EXPECT_THAT(CoreMathIsExact(exact), IsEmpty());
}

TEST(Architecture, TasksStartInOneFile) { EXPECT_THAT(TasksStartInOneFile(Project()), IsEmpty()); }

TEST(Architecture, ASecondStartOfTasksIsSeen) {
  for (const std::string header : {"<tbb/parallel_for.h>", "<oneapi/tbb/task_group.h>"}) {
    for (const std::string file : {"core/src/field/field.cc", "server/compute/compute_pool.cc"}) {
      const SourceTree tree = Planted(file, "\n#include " + header + "\n");
      EXPECT_THAT(TasksStartInOneFile(tree), Contains(HasSubstr(file))) << header;
    }
  }
}

TEST(Architecture, FilesKeepTheirRooms) { EXPECT_THAT(FilesKeepTheirRooms(Project()), IsEmpty()); }

TEST(Architecture, AFileWithoutARoomIsSeen) {
  for (const std::string path :
       {"core/src/stray.h", "core/src/attic/stray.h", "server/stray.cc", "client/stray.h",
        "client/attic/stray.h", "client/input/stray.cc", "client/input/attic/stray.cc"}) {
    EXPECT_THAT(FilesKeepTheirRooms(Planted(path, "")), Contains(HasSubstr(path + ": lies in no")));
  }
}

TEST(Architecture, AnIncludeOfARoomBelowIsSeen) {
  for (const std::string include : {"mesh/mesh.h", "workspace.h"}) {
    const SourceTree tree = Planted("core/src/rings/rings.h", "\n#include \"" + include + "\"\n");
    EXPECT_THAT(FilesKeepTheirRooms(tree), Contains(HasSubstr("rings.h: includes " + include)));
  }
  EXPECT_THAT(FilesKeepTheirRooms(
                  Planted("server/compute/worker.h", "\n#include \"server/stream/session.h\"\n")),
              Contains(HasSubstr("of a room below its own")));
  for (const auto& [file, include] : std::map<std::string, std::string>{
           {"client/include/partiemc/client/stream.h", "client/library/channel.h"},
           {"client/library/channel.h", "client/output/text.h"},
           {"client/output/formats/svg.cc", "client/input/plane.h"},
           {"client/recording/block.h", "client/cli/console.h"},
           {"client/input/base/columns.h", "client/input/formats/frame_reader.h"},
           {"client/input/formats/xyz.cc", "client/input/plane.h"}}) {
    EXPECT_THAT(FilesKeepTheirRooms(Planted(file, "\n#include \"" + include + "\"\n")),
                Contains(HasSubstr(file + ": includes " + include + ", of a room below")));
  }
}

TEST(Architecture, AnIncludeWithoutItsRoomIsSeen) {
  const SourceTree tree = Planted("core/src/rings/rings.h", "\n#include \"components.h\"\n");
  EXPECT_THAT(FilesKeepTheirRooms(tree), Contains(HasSubstr("without its room")));
  EXPECT_THAT(
      FilesKeepTheirRooms(
          Planted("client/library/channel.cc", "\n#include \"library/stream_call.h\"\n")),
      Contains("client/library/channel.cc: includes library/stream_call.h without its room"));
}

TEST(Architecture, NoFolderIsTooFull) { EXPECT_THAT(NoFolderIsTooFull(Project()), IsEmpty()); }

TEST(Architecture, AFolderThatIsTooFullIsSeen) {
  for (const std::string folder : {"core/src/normals", "client/input/extra", "proto/extra"}) {
    SourceTree tree = Project();
    for (char name = 'a'; name <= 's'; ++name) {
      tree[folder + "/" + std::string(1, name) + "_.h"] = "";
      tree[folder + "/" + std::string(1, name) + "_.cc"] = "";
    }
    const std::size_t stems = folder == "core/src/normals" ? 22 : 19;
    EXPECT_THAT(NoFolderIsTooFull(tree),
                Contains(folder + ": has " + std::to_string(stems) + " stems"));
  }
}

TEST(Architecture, GrpcStaysInItsRooms) { EXPECT_THAT(GrpcStaysInItsRooms(Project()), IsEmpty()); }

TEST(Architecture, GrpcInAnotherRoomIsSeen) {
  for (const std::string file :
       {"server/telemetry/metrics.cc", "server/stream/session.cc", "server/calls/methods.cc"}) {
    EXPECT_THAT(GrpcStaysInItsRooms(Planted(file, "\n#include <grpcpp/grpcpp.h>\n")),
                Contains(file + ": includes grpcpp/grpcpp.h"));
  }
}

TEST(Architecture, TimeAndChanceArePassedIn) {
  EXPECT_THAT(TimeAndChanceArePassedIn(Project()), IsEmpty());
}

TEST(Architecture, TimeReadAroundTheClockIsSeen) {
  for (const std::string file :
       {"server/relay/relay.cc", "client/library/adapters/async_stream.cc"}) {
    for (const std::string use : {"std::chrono::steady_clock::now()", "std::random_device{}()",
                                  "std::this_thread::sleep_for(pause)"}) {
      EXPECT_THAT(TimeAndChanceArePassedIn(Planted(file, "\nauto x = " + use + ";\n")),
                  Contains(HasSubstr(file + ": uses")))
          << use;
    }
  }
}

TEST(Architecture, StagesKeepTheirOrder) {
  EXPECT_THAT(StagesKeepTheirOrder(Project()), IsEmpty());
}

TEST(Architecture, AStageThatLooksAheadIsSeen) {
  const SourceTree direct = Planted("core/src/bins/bins.cc", "\n#include \"rings/rings.h\"\n");
  EXPECT_THAT(StagesKeepTheirOrder(direct), Contains(HasSubstr("core/src/bins/bins.cc: reaches")));
}

TEST(Architecture, AStageThatLooksAheadThroughAnotherHeaderIsSeen) {
  SourceTree tree = Planted("core/src/field/field.h", "\n#include \"field/detour.h\"\n");
  tree["core/src/field/detour.h"] = "#include \"mesh/mesh.h\"\n";
  EXPECT_THAT(StagesKeepTheirOrder(tree), Contains(HasSubstr("core/src/field/field.h: reaches")));
}

TEST(Architecture, ASecondFileThatKnowsAllStagesIsSeen) {
  const SourceTree tree =
      Planted("core/src/pipeline.cc", Project().at("core/src/reconstructor.cc"));
  EXPECT_THAT(StagesKeepTheirOrder(tree), Contains(HasSubstr("core/src/pipeline.cc: reaches all")));
}

TEST(Architecture, SessionsAreFreeOfGrpc) {
  EXPECT_THAT(SessionsAreFreeOfGrpc(Project()), IsEmpty());
}

TEST(Architecture, ASessionThatReachesAMessageIsSeen) {
  for (const std::string file :
       {"compute/compute_pool.h", "stream/session.cc", "stream/stream_state_machine.h",
        "stream/stream_state_machine.cc", "stream/stream_registry.cc", "compute/heap.h"}) {
    const SourceTree tree = Planted("server/" + file, "\n#include <grpcpp/grpcpp.h>\n");
    EXPECT_THAT(SessionsAreFreeOfGrpc(tree),
                Contains("server/" + file + ": reaches grpcpp/grpcpp.h"));
  }
  SourceTree tree = Planted("server/compute/worker.h", "\n#include \"detour.h\"\n");
  tree["server/detour.h"] = "#include \"partiemc/v1/reconstruction.pb.h\"\n";
  EXPECT_THAT(SessionsAreFreeOfGrpc(tree), Contains(HasSubstr("reconstruction.pb.h")));
}

TEST(Architecture, ASessionLibraryThatIsGoneIsSeen) {
  SourceTree tree = Project();
  tree.erase("server/CMakeLists.txt");
  EXPECT_THAT(SessionsAreFreeOfGrpc(tree), testing::SizeIs(1));
  EXPECT_THAT(
      SessionsAreFreeOfGrpc(Without("server/CMakeLists.txt", "partiemc_server_session STATIC")),
      testing::SizeIs(1));
}

TEST(Architecture, ServerAndClientAreStrangers) {
  EXPECT_THAT(ServerAndClientAreStrangers(Project()), IsEmpty());
}

TEST(Architecture, AServerThatUsesTheClientIsSeen) {
  SourceTree tree = Planted("client/private.h", "");
  tree["server/extra.cc"] = "#include \"client/private.h\"\n";
  EXPECT_THAT(ServerAndClientAreStrangers(tree),
              Contains("server/extra.cc: reaches client/private.h"));
  EXPECT_THAT(ServerAndClientAreStrangers(
                  Planted("client/CMakeLists.txt", "target_link_libraries(x partiemc_server)")),
              Contains("client/CMakeLists.txt: links to the server"));
}

TEST(Architecture, NoFileNamesAMachine) { EXPECT_THAT(NoMachinePaths(Project()), IsEmpty()); }

TEST(Architecture, APathOfAMachineIsSeen) {
  const SourceTree tree = Planted("README.md",
                                  "\ncd /ho"
                                  "me/alice/partiemc\n");
  EXPECT_THAT(NoMachinePaths(tree), Contains(HasSubstr("README.md: names")));
}

TEST(Architecture, TestsAreBuilt) { EXPECT_THAT(TestsAreBuilt(Project()), IsEmpty()); }

TEST(Architecture, ATestThatIsNotBuiltIsSeen) {
  EXPECT_THAT(
      TestsAreBuilt(Without("tests/core/CMakeLists.txt", "phases_accuracy_test.cc")),
      Contains(HasSubstr("tests/core/phases_accuracy_test.cc: no CMakeLists.txt names it")));
}

TEST(Architecture, PackageSetsAreComplete) {
  EXPECT_THAT(PackageSetsAreComplete(Project()), IsEmpty());
}

TEST(Architecture, APackageThatIsNotListedIsSeen) {
  EXPECT_THAT(PackageSetsAreComplete(Without("docker/packages/core.txt", "libtbb-dev")),
              Contains(HasSubstr("docker/packages/core.txt: lacks libtbb-dev")));
  EXPECT_THAT(PackageSetsAreComplete(Planted("core/CMakeLists.txt", "\nfind_package(Novelty)\n")),
              Contains(HasSubstr("looks for Novelty")));
  EXPECT_THAT(PackageSetsAreComplete(
                  Planted("core/CMakeLists.txt", "\npkg_check_modules(Z REQUIRED libzstd)\n")),
              Contains(HasSubstr("docker/packages/core.txt: lacks libzstd-dev")));
}

}  // namespace
}  // namespace partiemc::architecture
