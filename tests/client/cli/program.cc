#include "client/cli/program.h"

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <thread>

namespace partiemc::client {
namespace {

constexpr std::chrono::seconds kDeadline(60);
constexpr std::chrono::milliseconds kPoll(5);

void Redirect(const std::string& path, int descriptor) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::dup2(file, descriptor);
  ::close(file);
}

}  // namespace

Program::Program(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<char*> pointers = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) {
    pointers.push_back(const_cast<char*>(argument.c_str()));
  }
  pointers.push_back(nullptr);
  const std::string out = directory_.Path("out"), error = directory_.Path("error");
  id_ = ::fork();
  if (id_ != 0) return;
  Redirect(out, STDOUT_FILENO);
  Redirect(error, STDERR_FILENO);
  ::execv(program.c_str(), pointers.data());
  ::_exit(127);
}

Program::~Program() {
  if (!Running()) return;
  Signal(SIGKILL);
  Wait();
}

void Program::Signal(int signal) const { ::kill(id_, signal); }

bool Program::Running() {
  if (ended_) return false;
  int status = 0;
  if (::waitpid(id_, &status, WNOHANG) == 0) return true;
  ended_ = true;
  exit_code_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return false;
}

int Program::Wait() {
  const auto until = std::chrono::steady_clock::now() + kDeadline;
  while (Running() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(kPoll);
  return exit_code_;
}

std::string Program::Out() const { return Content(directory_.Path("out")); }
std::string Program::Error() const { return Content(directory_.Path("error")); }

Ran RunPartiemc(const std::vector<std::string>& arguments) {
  Program program(PARTIEMC_PROGRAM, arguments);
  const int exit_code = program.Wait();
  return {exit_code, program.Out(), program.Error()};
}

Ran RunPartiemcOnFullDisk(int kilobytes, std::vector<std::string> arguments) {
  // dash counts blocks of 512 bytes.
  const std::string limited = "ulimit -f " + std::to_string(2 * kilobytes) + "; exec \"$0\" \"$@\"";
  arguments.insert(arguments.begin(), {"-c", limited, PARTIEMC_PROGRAM});
  Program program("/bin/sh", arguments);
  const int exit_code = program.Wait();
  return {exit_code, program.Out(), program.Error()};
}

std::string LastLine(const std::string& lines) {
  if (lines.empty()) return lines;
  const std::string whole = lines.substr(0, lines.size() - (lines.back() == '\n' ? 1 : 0));
  return whole.substr(whole.rfind('\n') + 1);
}

ServerProgram::ServerProgram()
    : program_(PARTIEMC_SERVER_PROGRAM,
               {"--address", "127.0.0.1:0", "--port-file", directory_.Path("port")}) {
  const auto until = std::chrono::steady_clock::now() + kDeadline;
  while (address_.empty() && program_.Running() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kPoll);
    std::string port = Content(directory_.Path("port"));
    if (!port.ends_with('\n')) continue;
    port.pop_back();
    address_ = "127.0.0.1:" + port.substr(port.rfind(':') + 1);
  }
}

ServerProgram::~ServerProgram() {
  program_.Signal(SIGTERM);
  program_.Wait();
}

std::vector<std::string> FilesIn(const std::filesystem::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (!entry.is_directory()) {
      names.push_back(entry.path().lexically_relative(directory).string());
    }
  }
  std::ranges::sort(names);
  return names;
}

std::string Content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> Column(const std::string& csv, const std::string& name) {
  std::istringstream lines(csv);
  std::vector<std::string> values;
  std::optional<std::size_t> wanted;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream cells_of_line(line);
    for (std::string cell; std::getline(cells_of_line, cell, ',');) cells.push_back(cell);
    if (wanted) {
      values.push_back(cells.at(*wanted));
    } else {
      wanted = static_cast<std::size_t>(std::ranges::find(cells, name) - cells.begin());
    }
  }
  return values;
}

}  // namespace partiemc::client
