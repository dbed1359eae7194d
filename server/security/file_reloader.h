// Files that may change while the server runs: certificates, keys, tokens.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"

namespace partiemc::server {

/// Looks at files from time to time and has them loaded again when one of them has changed. A load
/// that fails is logged, once for each change, and leaves in force what was loaded before.
class FileReloader {
 public:
  using Load = std::function<absl::Status()>;

  FileReloader() = default;
  ~FileReloader();
  FileReloader(const FileReloader&) = delete;
  FileReloader& operator=(const FileReloader&) = delete;

  /// Loads for the first time, and again whenever a file of `files` has changed. `what` names them
  /// in the log. `load` is called by one thread at a time. Before Start only.
  /// Errors: that of the first load; then nothing is watched.
  absl::Status Add(std::string what, std::vector<std::string> files, Load load);

  /// Begins to look, every `interval`. Without anything added no thread is started.
  void Start(std::chrono::milliseconds interval);

 private:
  struct Watched {
    std::string what;
    std::vector<std::string> files;
    Load load;
    std::string stamp;  // Of the files as they were when they were loaded, or failed to be.
  };

  void Run(std::chrono::milliseconds interval);
  static void Look(Watched& watched);

  std::vector<Watched> watched_;  // After Start of the thread alone.
  std::mutex mutex_;
  std::condition_variable stop_asked_;
  bool stopping_ = false;  // Guarded by mutex_.
  std::thread thread_;
};

}  // namespace partiemc::server
