// Replaces vtk_reader.cc in builds without VTK.
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {

absl::StatusOr<std::unique_ptr<FrameReader>> OpenVtk(const std::string& path,
                                                     const ColumnRequest& /*request*/) {
  return absl::UnimplementedError(
      Concat(path,
             ": this partiemc was built without VTK; install libvtk9-dev and configure with "
             "-DPARTIEMC_VTK=ON"));
}

}  // namespace partiemc::client::input
