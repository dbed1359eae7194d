#include "client/output/atomic_file.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "client/output/fixtures.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Limits the size of files, to simulate a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_;
  void (*handler_)(int);
};

TEST(AtomicFile, HasExactlyTheAppendedBytes) {
  support::TemporaryFolder directory;
  auto file = AtomicFile::Create(directory / "out.txt");
  ASSERT_TRUE(file.ok()) << file.status();
  std::string expected;
  for (int k = 0; k < 5000; ++k) {
    const std::string part(static_cast<std::size_t>(k % 97), static_cast<char>('a' + k % 26));
    ASSERT_TRUE(file->Append(part).ok());
    expected += part;
  }
  const std::string large(200'000, 'x');
  ASSERT_TRUE(file->Append(large).ok());
  ASSERT_TRUE(file->Commit().ok());
  EXPECT_EQ(ReadFile(directory / "out.txt"), expected + large);
  EXPECT_THAT(directory.Entries(), ElementsAre("out.txt"));
}

TEST(AtomicFile, HasNoNameBeforeCommit) {
  support::TemporaryFolder directory;
  auto file = AtomicFile::Create(directory / "out.txt");
  ASSERT_TRUE(file.ok());
  ASSERT_TRUE(file->Append(std::string(100'000, 'x')).ok());
  EXPECT_FALSE(std::filesystem::exists(directory / "out.txt"));
}

TEST(AtomicFile, KeepsTheOldFileWithoutCommit) {
  support::TemporaryFolder directory;
  ASSERT_TRUE(WriteFileAtomically(directory / "out.txt", "old").ok());
  {
    auto file = AtomicFile::Create(directory / "out.txt");
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file->Append(std::string(100'000, 'x')).ok());
  }
  EXPECT_EQ(ReadFile(directory / "out.txt"), "old");
  EXPECT_THAT(directory.Entries(), ElementsAre("out.txt"));
}

TEST(AtomicFile, AnOldFileIsReplaced) {
  support::TemporaryFolder directory;
  ASSERT_TRUE(WriteFileAtomically(directory / "out.txt", "a long old content").ok());
  ASSERT_TRUE(WriteFileAtomically(directory / "out.txt", "new").ok());
  EXPECT_EQ(ReadFile(directory / "out.txt"), "new");
}

TEST(AtomicFile, NamesAMissingDirectory) {
  support::TemporaryFolder directory;
  const absl::Status status = WriteFileAtomically(directory / "missing/out.txt", "text");
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(status.message()), HasSubstr("missing/out.txt"));
  EXPECT_THAT(std::string(status.message()), HasSubstr("create its directory first"));
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(AtomicFile, RefusesADirectoryBeforeWriting) {
  support::TemporaryFolder directory;
  std::filesystem::create_directory(directory / "out.txt");
  EXPECT_FALSE(AtomicFile::Create(directory / "out.txt").ok());
  EXPECT_THAT(directory.Entries(), ElementsAre("out.txt"));
}

TEST(AtomicFile, LeavesNothingIfTheDiskIsFull) {
  support::TemporaryFolder directory;
  const FileSizeLimit limit(150'000);
  auto file = AtomicFile::Create(directory / "out.txt");
  ASSERT_TRUE(file.ok());
  absl::Status status;
  for (int k = 0; k < 100 && status.ok(); ++k) status = file->Append(std::string(10'000, 'x'));
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(std::string(status.message()), HasSubstr("out.txt: cannot be written: "));
  EXPECT_FALSE(file->Commit().ok()) << "an error must not be forgotten";
  { const AtomicFile gone = *std::move(file); }
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

TEST(AtomicFile, LeavesNothingIfTheDiskIsFullAtTheEnd) {
  support::TemporaryFolder directory;
  auto file = AtomicFile::Create(directory / "out.txt");
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_TRUE(file->Append(std::string(2000, 'x')).ok());  // Buffered until Commit.
  {
    const FileSizeLimit limit(1000);
    EXPECT_FALSE(file->Commit().ok());
  }
  { const AtomicFile gone = *std::move(file); }
  EXPECT_THAT(directory.Entries(), IsEmpty());
}

// Uses a new pipe, because a mistake with /dev/null would replace the machine's.
TEST(AtomicFile, WritesAPipeDirectly) {
  support::TemporaryFolder directory;
  const std::filesystem::path pipe = directory / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  // Opened for reading first, so that the writer does not block.
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  EXPECT_TRUE(WriteFileAtomically(pipe, "text").ok());
  char read[8] = {};
  EXPECT_EQ(::read(reader, read, sizeof(read)), 4);
  EXPECT_STREQ(read, "text");
  ::close(reader);
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  EXPECT_THAT(directory.Entries(), ElementsAre("pipe"));
}

TEST(AtomicFile, ASymbolicLinkIsFollowed) {
  support::TemporaryFolder directory;
  ASSERT_TRUE(WriteFileAtomically(directory / "real.txt", "old").ok());
  std::filesystem::create_symlink("real.txt", directory / "link.txt");
  ASSERT_TRUE(WriteFileAtomically(directory / "link.txt", "new").ok());
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "link.txt"));
  EXPECT_EQ(ReadFile(directory / "real.txt"), "new");
}

TEST(AtomicFile, MessagesAreOneLine) {
  const absl::Status status = WriteFileAtomically("/missing\ndirectory/out.txt", "text");
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr("\n")));
}

TEST(AtomicFile, HasThePermissionsOfANewFile) {
  support::TemporaryFolder directory;
  const mode_t before = ::umask(027);
  ASSERT_TRUE(WriteFileAtomically(directory / "out.txt", "text").ok());
  ::umask(before);
  struct stat found;
  ASSERT_EQ(::stat((directory / "out.txt").c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777u, 0640u);
}

}  // namespace
}  // namespace partiemc::client
