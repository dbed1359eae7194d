// Reloads files that may change while the server runs: certificates, keys, tokens.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "common/mutex.h"

namespace partiemc::server {

/// Polls files and reloads them after a change. A change is loaded when two successive looks find
/// the files the same, because another program may still be writing them. If a load fails, the
/// failure is logged once per change, and the previous content stays in use.
class FileReloader {
 public:
  using Load = std::function<absl::Status()>;

  FileReloader() = default;
  ~FileReloader();
  FileReloader(const FileReloader&) = delete;
  FileReloader& operator=(const FileReloader&) = delete;

  /// Calls `load` now, and after each change of `files` on the polling thread. `what` names the
  /// files in the log. Requires: Start was not called yet. Errors: the error of the first load; the
  /// files are then not watched.
  absl::Status Add(std::string what, std::vector<std::string> files, Load load);

  /// Starts a thread that polls the files every `interval`. Starts no thread if there are no files.
  void Start(std::chrono::milliseconds interval);

  /// Polls all files once, and reloads those whose change has settled. Called by the polling
  /// thread; other threads may call it only if the polling thread does not run.
  void Look();

 private:
  struct Watched {
    std::string what;
    std::vector<std::string> files;
    Load load;
    // Stamps of the files at the last load and at the last look.
    std::string loaded = {}, seen = {};
  };

  void Run(std::chrono::milliseconds interval);
  static void Look(Watched& watched);

  std::vector<Watched> watched_;  // After Start, only the thread uses it.
  Mutex mutex_;
  CondVar stop_asked_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace partiemc::server
