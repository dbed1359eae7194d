// Replaces the readers of formats whose library this build lacks.
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

[[maybe_unused]] absl::Status BuiltWithout(const std::string& path, std::string_view library,
                                           std::string_view package, std::string_view option) {
  return absl::UnimplementedError(
      Concat(path, ": this partiemc was built without ", library, "; install ", package,
             ", configure with -D", option,
             "=ON and build it again, or write the particles as NPZ or CSV"));
}

}  // namespace

#ifndef PARTIEMC_HAVE_VTK
absl::StatusOr<std::unique_ptr<FrameReader>> OpenVtk(const std::string& path,
                                                     const ColumnRequest& /*request*/) {
  return BuiltWithout(path, "VTK", "libvtk9-dev", "PARTIEMC_VTK");
}
#endif

#ifndef PARTIEMC_HAVE_HDF5
absl::StatusOr<std::unique_ptr<FrameReader>> OpenHdf5(const std::string& path,
                                                      const ColumnRequest& /*request*/) {
  return BuiltWithout(path, "HDF5", "libhdf5-dev", "PARTIEMC_HDF5");
}
#endif

}  // namespace partiemc::client::input
