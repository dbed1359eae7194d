// partiemc-server as a program: what scripts, containers and their health checks rely on.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

extern char** environ;

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

std::string FileText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// A server process, its output in a file.
class Program {
 public:
  explicit Program(std::vector<std::string> arguments) : output_(Temporary("output")) {
    arguments.insert(arguments.begin(), PARTIEMC_SERVER);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output_.c_str(),
                                     O_CREAT | O_TRUNC | O_WRONLY, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    EXPECT_EQ(posix_spawn(&process_, argv[0], &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  ~Program() {
    if (process_ > 0) {
      kill(process_, SIGKILL);
      Wait();
    }
  }

  void Signal(int signal) { kill(process_, signal); }

  // The exit code, or -1 for a death by signal.
  int Wait() {
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string Output() const { return FileText(output_); }

  // A path of this test's own.
  static std::string Temporary(const std::string& name) {
    static int count = 0;
    return ::testing::TempDir() + "/partiemc_program_" + std::to_string(getpid()) + "_" +
           std::to_string(count++) + "_" + name;
  }

 private:
  std::string output_;
  pid_t process_ = 0;
};

int RunProgram(const std::vector<std::string>& arguments, std::string* output = nullptr) {
  Program program(arguments);
  const int code = program.Wait();
  if (output != nullptr) *output = program.Output();
  return code;
}

// A server on a port that it chose, and the address that it wrote.
class Serving {
 public:
  explicit Serving(std::vector<std::string> arguments = {})
      : port_file_(Program::Temporary("port")), program_(With(std::move(arguments))) {
    while (!std::filesystem::exists(port_file_)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    address_ = FileText(port_file_);
    address_.pop_back();  // The end of the line.
  }
  const std::string& address() const { return address_; }
  Program& program() { return program_; }

 private:
  std::vector<std::string> With(std::vector<std::string> arguments) const {
    const std::vector<std::string> ours = {"--address", "127.0.0.1:0", "--port-file", port_file_};
    arguments.insert(arguments.end(), ours.begin(), ours.end());
    return arguments;
  }

  std::string port_file_;
  Program program_;
  std::string address_;
};

TEST(Program, ServesSaysWhereAndLeavesWithZeroOnEitherSignal) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Serving server;
    EXPECT_EQ(RunProgram({"--health-check", server.address()}), 0);
    server.program().Signal(signal);
    EXPECT_EQ(server.program().Wait(), 0);
    EXPECT_THAT(server.program().Output(), HasSubstr("listening on " + server.address()));
    EXPECT_THAT(server.program().Output(), HasSubstr("stopped"));
  }
}

TEST(Program, TheHealthCheckFailsInOneLineWhereNobodyServes) {
  std::string address;
  {
    Serving server;
    address = server.address();
  }
  std::string output;
  EXPECT_EQ(RunProgram({"--health-check", address}, &output), 1);
  EXPECT_THAT(output, HasSubstr("no healthy server at " + address));
  EXPECT_EQ(output.find('\n'), output.size() - 1);
}

TEST(Program, AnAddressInUseFailsInOneLine) {
  Serving server;
  std::string output;
  EXPECT_EQ(RunProgram({"--address", server.address()}, &output), 1);
  EXPECT_THAT(output, HasSubstr("cannot listen on " + server.address()));
  EXPECT_EQ(output.find('\n'), output.size() - 1) << output;
}

TEST(Program, AWrongCommandLineFailsWithTwo) {
  std::string output;
  EXPECT_EQ(RunProgram({"--threads", "none"}, &output), 2);
  EXPECT_THAT(output, HasSubstr("--threads"));
}

TEST(Program, APortFileThatCannotBeWrittenFailsNamingIt) {
  std::string output;
  EXPECT_EQ(
      RunProgram({"--address", "127.0.0.1:0", "--port-file", "/no/such/folder/port"}, &output), 1);
  EXPECT_THAT(output, HasSubstr("/no/such/folder/port"));
}

TEST(Program, LogsOneJsonObjectALineWhereAsked) {
  Serving server({"--log-format", "json"});
  server.program().Signal(SIGTERM);
  ASSERT_EQ(server.program().Wait(), 0);
  std::istringstream lines(server.program().Output());
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_EQ(line.find("{\"time\":\""), 0u) << line;
    EXPECT_EQ(line.rfind("\"}"), line.size() - 2) << line;
  }
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace partiemc::server
