// Runs the project's programs as a shell would.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "support/temporary_folder.h"

namespace partiemc::client {

/// A running program. Its output goes to files, so it never waits for a reader.
class Program {
 public:
  Program(const std::string& program, const std::vector<std::string>& arguments);
  /// Kills it if it still runs.
  ~Program();

  void Signal(int signal) const;
  bool Running();
  /// Waits for the end, at most a minute. Returns 128 + N for a signal N, -1 on a timeout.
  int Wait();

  pid_t id() const { return id_; }
  std::string Out() const;
  std::string Error() const;

 private:
  support::TemporaryFolder directory_;
  pid_t id_ = -1;
  int exit_code_ = -1;
  bool ended_ = false;
};

struct Ran {
  int exit_code;
  std::string out, error;
};

/// Runs `partiemc` with these arguments.
Ran RunPartiemc(const std::vector<std::string>& arguments);
/// Same with files limited to `kilobytes`, which simulates a full disk.
Ran RunPartiemcOnFullDisk(int kilobytes, std::vector<std::string> arguments);

/// The last line without its newline.
std::string LastLine(const std::string& lines);

/// A real server on a port chosen by the system.
class ServerProgram {
 public:
  ServerProgram();
  ~ServerProgram();
  const std::string& address() const { return address_; }
  void Signal(int signal) const { program_.Signal(signal); }
  std::string Log() const { return program_.Error(); }

 private:
  support::TemporaryFolder directory_;
  Program program_;
  std::string address_;
};

/// Sorted names of all files below a directory, including hidden ones.
std::vector<std::string> FilesIn(const std::filesystem::path& directory);

std::string Content(const std::string& path);

/// One column of a statistics file.
std::vector<std::string> Column(const std::string& csv, const std::string& name);

/// The bundled recording.
inline const std::string kDamBreak = PARTIEMC_SOURCE_DIR "/client/recordings/dam_break.pemc";

}  // namespace partiemc::client
