#include <random>

#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

absl::Status Refusal(const std::string& name, const std::string& content) {
  const support::TemporaryFolder directory;
  return ReadAll(directory.Write(name, content)).status;
}

TEST(Refusals, FormatsThatAreNotReadAreNamedWithWhatToDo) {
  using namespace std::string_literals;
  const auto code = absl::StatusCode::kUnimplemented;
  ExpectRefused(Refusal("a", "\x7fNSJb"), code, {"BGEO", "VTP or CSV"});
  ExpectRefused(Refusal("a", "BgeoV\0\0\0\x13"s + std::string(32, '\0')), code, {"version 19"});
  const absl::Status hdf5 = Refusal("a.h5", "\x89HDF\r\n\x1a\n and no more");
  if (hdf5.code() == code) {  // A build without HDF5.
    ExpectRefused(hdf5, code, {"a.h5", "libhdf5-dev", "-DPARTIEMC_HDF5=ON"});
  } else {
    ExpectRefused(hdf5, absl::StatusCode::kDataLoss, {"a.h5", "libhdf5", "truncated"});
  }
  ExpectRefused(Refusal("a.pdb", "ATOM 1\n"), code, {"PDB"});
  ExpectRefused(Refusal("a.xyz", "\x01\x02\0\0\0\0\x80\x3f"s), code,
                {"raw binary xyz", "numpy.fromfile"});
  ExpectRefused(Refusal("in.dam", "# a script\nunits lj\n"), code, {"LAMMPS input script"});
  ExpectRefused(Refusal("run.py", "x,y\n1,2\n"), code, {"program"});
  ExpectRefused(Refusal("data.dam", "LAMMPS data\n\n12 atoms\n0 1 xlo xhi\n"), code,
                {"LAMMPS data file"});
  ExpectRefused(Refusal("a.vtm", "<VTKFile type=\"ImageData\">\n"), code, {".vtp"});
  ExpectRefused(Refusal("a.pkl", "\x80\x04\x95"), code, {"pickle"});
}

TEST(Refusals, TheSamplesOfOtherFormatsAreRefused) {
  const auto code = absl::StatusCode::kUnimplemented;
  ExpectRefused(ReadAll(SamplePath("splashsurf_raw_f4.xyz")).status, code, {"raw binary xyz"});
  ExpectRefused(ReadAll(SamplePath("in.styles")).status, code, {"LAMMPS input script"});
}

TEST(Refusals, RubbishUnderAnyNameIsRefusedInOneLine) {
  const std::uint32_t seed = 20;
  std::mt19937 random(seed);
  const support::TemporaryFolder directory;
  for (const char* name :
       {"a.csv", "a.npy", "a.npz", "a.vtp", "a.vtk", "a.xyz", "a.txt", "dump.a"}) {
    for (const char* mark : {"", "\x93NUMPY\x01", "PK\x03\x04", "# vtk DataFile Version 4.2\n",
                             "ITEM: TIMESTEP\n", "\x1f\x8b\x08", "\x28\xb5\x2f\xfd"}) {
      std::string content = mark;
      for (int k = 0; k < 300; ++k) content.push_back(static_cast<char>(random()));
      const absl::Status status = ReadAll(directory.Write(name, content)).status;
      EXPECT_FALSE(status.ok()) << name << " seed " << seed;
      EXPECT_EQ(std::string(status.message()).find('\n'), std::string::npos) << status;
    }
  }
}

}  // namespace
}  // namespace partiemc::client
