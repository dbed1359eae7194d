// The readers that replace VTK's and HDF5's in a build without these libraries.
#include "client/input/formats/frame_reader.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client::input {
namespace {

TEST(AbsentFormats, ErrorsNameThePackageTheOptionAndAnotherFormat) {
  struct Case {
    OpenReader* open;
    std::string package, option;
  };
  for (const Case& one : {Case{OpenHdf5, "libhdf5-dev", "-DPARTIEMC_HDF5=ON"},
                          Case{OpenVtk, "libvtk9-dev", "-DPARTIEMC_VTK=ON"}}) {
    const absl::Status status = one.open("run.h5", {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kUnimplemented);
    for (const std::string& part :
         {std::string("run.h5"), one.package, one.option, std::string("NPZ")}) {
      EXPECT_THAT(std::string(status.message()), testing::HasSubstr(part));
    }
  }
}

}  // namespace
}  // namespace partiemc::client::input
