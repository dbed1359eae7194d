// Files that change while they are watched.
#include "server/security/file_reloader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

// Each change has another size, so that it does not depend on the resolution of the file's times.
class FileReloaderTest : public ::testing::Test {
 protected:
  FileReloaderTest() {
    folder_.Write("file", "first");
    EXPECT_TRUE(reloader_
                    .Add("file", {folder_.Path("file")},
                         [this] {
                           ++loads_;
                           return load_result_;
                         })
                    .ok());
  }
  // The loads in one look.
  int LoadsInOneLook() {
    const int before = loads_;
    reloader_.Look();
    return loads_ - before;
  }

  const support::TemporaryFolder folder_;
  FileReloader reloader_;
  absl::Status load_result_;
  int loads_ = 0;
};

TEST_F(FileReloaderTest, LoadsAtOnceAndNotAgainWithoutAChange) {
  EXPECT_EQ(loads_, 1);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(LoadsInOneLook(), 0) << i;
}

TEST_F(FileReloaderTest, LoadsAChangeThatTwoLooksFindTheSame) {
  EXPECT_EQ(LoadsInOneLook(), 0);
  folder_.Write("file", "second");
  EXPECT_EQ(LoadsInOneLook(), 0);
  EXPECT_EQ(LoadsInOneLook(), 1);
  EXPECT_EQ(LoadsInOneLook(), 0);
}

TEST_F(FileReloaderTest, DoesNotLoadAFileThatIsBeingWritten) {
  std::string content = "some";
  for (int i = 0; i < 5; ++i) {
    folder_.Write("file", content += " more");
    EXPECT_EQ(LoadsInOneLook(), 0) << i;
  }
  EXPECT_EQ(LoadsInOneLook(), 1);
}

TEST_F(FileReloaderTest, TriesEachChangeOnceIfItsLoadFails) {
  load_result_ = absl::InvalidArgumentError("wrong");
  for (const char* content : {"wrong content", "other wrong content"}) {
    folder_.Write("file", content);
    EXPECT_EQ(LoadsInOneLook() + LoadsInOneLook() + LoadsInOneLook(), 1) << content;
  }
  std::filesystem::remove(folder_.Path("file"));
  EXPECT_EQ(LoadsInOneLook() + LoadsInOneLook() + LoadsInOneLook(), 1);
}

}  // namespace
}  // namespace partiemc::server
