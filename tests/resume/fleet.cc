#include "resume/fleet.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <thread>
#include <utility>

#include "resume/options.h"

extern char** environ;

namespace partiemc::resume {
namespace {

constexpr std::chrono::seconds kStartTime(30);
constexpr std::chrono::milliseconds kPoll(5);

void WaitFor(const std::function<bool()>& ready, const std::string& what) {
  const auto give_up = std::chrono::steady_clock::now() + kStartTime;
  while (!ready()) {
    if (std::chrono::steady_clock::now() > give_up) {
      FAIL() << what << " does not come up";
    }
    std::this_thread::sleep_for(kPoll);
  }
}

bool Connects(const std::string& path) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  const int result = connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address));
  close(fd);
  return result == 0;
}

// A lost server is skipped for a while; a stream that cannot be opened at one server goes to the
// next.
std::string HaproxyFile(const std::string& socket, const std::vector<std::string>& servers) {
  std::string text =
      "defaults\n"
      "  mode http\n"
      "  timeout connect 1s\n"
      "  timeout client 1h\n"
      "  timeout server 1h\n"
      "  option redispatch 1\n"
      "  retries 3\n"
      "frontend streams\n"
      "  bind unix@" +
      socket +
      " proto h2\n"
      "  default_backend servers\n"
      "backend servers\n"
      "  balance roundrobin\n";
  int number = 0;
  for (const std::string& server : servers) {
    text += "  server s" + std::to_string(++number) + " " + server +
            " proto h2 check inter 100ms fall 1 rise 1\n";
  }
  return text;
}

// With its default limits nginx would end a stream after one megabyte or one minute, and skip a
// restarted server for a while.
std::string NginxFile(const std::string& folder, const std::string& socket,
                      const std::vector<std::string>& servers) {
  std::string text = "daemon off;\nmaster_process off;\npid " + folder + "/pid;\nerror_log " +
                     folder +
                     "/error.log;\n"
                     "events { worker_connections 512; }\n"
                     "http {\n"
                     "  access_log off;\n"
                     "  client_max_body_size 0;\n"
                     "  client_body_timeout 1h;\n"
                     "  keepalive_timeout 1h;\n"
                     "  keepalive_requests 1000000000;\n"
                     "  grpc_read_timeout 1h;\n"
                     "  grpc_send_timeout 1h;\n"
                     "  grpc_connect_timeout 1s;\n"
                     "  grpc_next_upstream error timeout;\n";
  for (const char* name : {"client_body", "proxy", "fastcgi", "uwsgi", "scgi"}) {
    text += std::string("  ") + name + "_temp_path " + folder + "/" + name + ";\n";
  }
  text += "  upstream servers {\n";
  for (const std::string& server : servers) {
    text += "    server " + server + " max_fails=0;\n";
  }
  text +=
      "  }\n"
      "  server {\n"
      "    listen unix:" +
      socket +
      " http2;\n"
      "    location / { grpc_pass grpc://servers; }\n"
      "  }\n"
      "}\n";
  return text;
}

}  // namespace

Fleet::Fleet(std::size_t count, std::vector<std::string> arguments)
    : arguments_(std::move(arguments)), servers_(count), addresses_(count) {
  for (std::size_t k = 0; k < count; ++k) Start(k, "127.0.0.1:0");
}

void Fleet::Start(std::size_t server, const std::string& address) {
  const support::TemporaryFolder folder;
  const std::string port_file = folder.Path("port");
  std::vector<std::string> arguments = arguments_;
  arguments.insert(arguments.end(), {"--address", address, "--port-file", port_file});
  const bool is_other = ++starts_ > size() && starts_ % 2 == 0;
  servers_[server] = std::make_unique<server::ServerProcess>(
      std::move(arguments),
      server::Surroundings{.program = is_other ? GetOptions().other_server : ""});
  WaitFor([&] { return std::filesystem::exists(port_file); }, "a server");
  addresses_[server] = server::FileText(port_file);
  if (!addresses_[server].empty()) addresses_[server].pop_back();  // Removes the newline.
}

void Fleet::KillAndRestart(std::size_t server) {
  servers_[server]->Signal(SIGKILL);
  servers_[server]->Wait();
  Start(server, std::string(addresses_[server]));
}

std::optional<int> Fleet::TerminateAndRestart(std::size_t server, std::chrono::seconds grace) {
  servers_[server]->Signal(SIGTERM);
  const auto code = servers_[server]->WaitFor(grace);
  Start(server, std::string(addresses_[server]));
  return code;
}

std::string RouteName(Route route) {
  switch (route) {
    case Route::kList:
      return "List";
    case Route::kHaproxy:
      return "Haproxy";
    case Route::kNginx:
      return "Nginx";
  }
  return "";
}

ProxyProcess::ProxyProcess(Route route, const std::vector<std::string>& servers)
    : socket_(folder_.Path("socket")) {
  const std::string folder = folder_.path().string();
  const std::string file = folder_.Path("configuration");
  const bool is_nginx = route == Route::kNginx;
  std::ofstream(file) << (is_nginx ? NginxFile(folder, socket_, servers)
                                   : HaproxyFile(socket_, servers));
  std::vector<std::string> arguments =
      is_nginx ? std::vector<std::string>{"nginx",
                                          "-p",
                                          folder,
                                          "-c",
                                          file,
                                          "-e",
                                          folder_.Path("error.log")}
               : std::vector<std::string>{"haproxy", "-db", "-q", "-f", file};
  // Debian installs both outside of a user's search path.
  arguments.front() = "/usr/sbin/" + arguments.front();
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int failed = posix_spawn(&process_, argv[0], nullptr, nullptr, argv.data(), environ);
  EXPECT_EQ(failed, 0) << arguments.front() << " cannot be started: docker/install.sh tests";
  if (failed != 0) process_ = 0;
  if (process_ > 0) WaitFor([this] { return Connects(socket_); }, arguments.front());
}

ProxyProcess::~ProxyProcess() {
  if (process_ > 0) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
}

}  // namespace partiemc::resume
