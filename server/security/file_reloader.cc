#include "server/security/file_reloader.h"

#include <sys/stat.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/telemetry/logging.h"

namespace partiemc::server {
namespace {

// Returns a text that changes if one of the files is written, replaced or removed, or gets another
// owner or mode. Follows symbolic links, so it also changes if a link's target is replaced, as in
// Kubernetes.
std::string StampOf(const std::vector<std::string>& files) {
  std::string stamp;
  for (const std::string& file : files) {
    struct stat status {};
    if (stat(file.c_str(), &status) != 0) {
      absl::StrAppend(&stamp, "absent;");
      continue;
    }
    absl::StrAppend(&stamp, status.st_dev, ",", status.st_ino, ",", status.st_size, ",",
                    status.st_mtim.tv_sec, ",", status.st_mtim.tv_nsec, ",", status.st_ctim.tv_sec,
                    ",", status.st_ctim.tv_nsec, ";");
  }
  return stamp;
}

}  // namespace

FileReloader::~FileReloader() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
  }
  stop_asked_.NotifyAll();
  if (thread_.joinable()) thread_.join();
}

absl::Status FileReloader::Add(std::string what, std::vector<std::string> files, Load load) {
  // Takes the stamp before the load, so that a change of a file during the load is detected at the
  // next poll.
  std::string stamp = StampOf(files);
  if (auto status = load(); !status.ok()) return status;
  watched_.push_back({std::move(what), std::move(files), std::move(load), std::move(stamp)});
  return absl::OkStatus();
}

void FileReloader::Start(std::chrono::milliseconds interval) {
  if (!watched_.empty()) thread_ = std::thread([this, interval] { Run(interval); });
}

void FileReloader::Run(std::chrono::milliseconds interval) {
  const MutexLock lock(mutex_);
  while (!stopping_) {
    const auto next = std::chrono::steady_clock::now() + interval;
    while (!stopping_ && stop_asked_.WaitUntil(mutex_, next)) {
    }
    if (stopping_) return;
    const MutexUnlock unlock(mutex_);
    Look();
  }
}

void FileReloader::Look() {
  for (Watched& watched : watched_) Look(watched);
}

void FileReloader::Look(Watched& watched) {
  std::string stamp = StampOf(watched.files);
  const bool is_settled = stamp == watched.seen;
  watched.seen = stamp;
  if (stamp == watched.loaded || !is_settled) return;
  watched.loaded = std::move(stamp);
  if (const auto status = watched.load(); status.ok()) {
    LogEvent(spdlog::level::info, watched.what + " reloaded", {});
  } else {
    LogEvent(spdlog::level::err,
             watched.what + " not reloaded, what was loaded before stays in force",
             {{"error", std::string(status.message())}});
  }
}

}  // namespace partiemc::server
