#include "service/server_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

extern char** environ;

namespace partiemc::server {
namespace {

std::vector<std::string> With(std::vector<std::string> arguments, const std::string& port_file) {
  const std::vector<std::string> ours = {"--address", "127.0.0.1:0", "--port-file", port_file};
  arguments.insert(arguments.end(), ours.begin(), ours.end());
  return arguments;
}

}  // namespace

std::string FileText(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::string ServerProgram() { return PARTIEMC_SERVER; }

ServerProcess::ServerProcess(std::vector<std::string> arguments, const Surroundings& surroundings)
    : folder_(std::make_unique<support::TemporaryFolder>()) {
  const std::string output = folder_->Path("output");
  arguments.insert(arguments.begin(),
                   surroundings.program.empty() ? PARTIEMC_SERVER : surroundings.program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(),
                                   O_CREAT | O_TRUNC | O_WRONLY, 0600);
  const int error = surroundings.standard_error;
  posix_spawn_file_actions_adddup2(&actions, error < 0 ? STDOUT_FILENO : error, STDERR_FILENO);
  std::vector<char*> variables;
  for (const std::string& more : surroundings.environment) {
    variables.push_back(const_cast<char*>(more.c_str()));
  }
  for (char** variable = environ; *variable != nullptr; ++variable) variables.push_back(*variable);
  variables.push_back(nullptr);
  EXPECT_EQ(posix_spawn(&process_, argv[0], &actions, nullptr, argv.data(), variables.data()), 0);
  posix_spawn_file_actions_destroy(&actions);
}

ServerProcess::~ServerProcess() {
  if (process_ > 0) {
    kill(process_, SIGKILL);
    Wait();
  }
}

ServerProcess::ServerProcess(ServerProcess&& other) noexcept
    : folder_(std::move(other.folder_)), process_(std::exchange(other.process_, 0)) {}

void ServerProcess::Signal(int signal) { kill(process_, signal); }

std::optional<int> ServerProcess::Reap(int options) {
  if (process_ <= 0) throw std::runtime_error("the server could not be started");
  int status = 0;
  if (waitpid(process_, &status, options) == 0) return std::nullopt;
  process_ = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

int ServerProcess::Wait() { return *Reap(0); }

std::optional<int> ServerProcess::WaitFor(std::chrono::milliseconds time) {
  const auto give_up = std::chrono::steady_clock::now() + time;
  std::optional<int> code;
  while (!(code = Reap(WNOHANG)) && std::chrono::steady_clock::now() < give_up) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return code;
}

double ServerProcess::ResidentMib() const { return StatusNumber("VmRSS:") / 1024; }

std::size_t ServerProcess::ThreadCount() const {
  return static_cast<std::size_t>(StatusNumber("Threads:"));
}

std::vector<std::string> ServerProcess::ThreadNames() const {
  std::vector<std::string> names;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process_) + "/task")) {
    // A thread may end meanwhile.
    std::string name;
    if (std::getline(std::ifstream(task.path() / "comm"), name)) names.push_back(name);
  }
  return names;
}

std::size_t ServerProcess::OpenFileCount() const {
  const std::filesystem::directory_iterator files("/proc/" + std::to_string(process_) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

double ServerProcess::StatusNumber(const std::string& field) const {
  std::ifstream status("/proc/" + std::to_string(process_) + "/status");
  double number = -1;
  for (std::string word; status >> word;) {
    if (word == field && status >> number) break;
  }
  EXPECT_GE(number, 0) << "no " << field << " of the server: has it gone?";
  return number;
}

int RunServer(const std::vector<std::string>& arguments, std::string* output) {
  ServerProcess process(arguments);
  const int code = process.Wait();
  if (output != nullptr) *output = process.Output();
  return code;
}

ServingProcess::ServingProcess(std::vector<std::string> arguments, const Surroundings& surroundings)
    : process_(With(std::move(arguments), folder_.Path("port")), surroundings) {
  const std::string port_file = folder_.Path("port");
  while (!std::filesystem::exists(port_file)) {
    if (const auto code = process_.WaitFor(std::chrono::milliseconds(5))) {
      throw std::runtime_error("the server left with " + std::to_string(*code) + ": " +
                               process_.Output());
    }
  }
  address_ = FileText(port_file);
  address_.pop_back();  // Removes the newline.
}

}  // namespace partiemc::server
