// The same 587 particles in the formats of several programs.
#include "client/input/fixtures.h"

namespace partiemc::client {
namespace {

constexpr std::size_t kParticles = 587;

struct Sample {
  const char* name;
  bool float32;
  bool has_velocities;
  bool has_time;
};

class Samples : public testing::TestWithParam<Sample> {};

TEST_P(Samples, HoldTheParticlesOfTheTable) {
  const RecordedFrame truth = ReadOne(SamplePath("semicolon_units_xz.csv"));
  ASSERT_EQ(truth.ParticleCount(), kParticles);
  const Sample& sample = GetParam();
  const RecordedFrame frame = ReadOne(SamplePath(sample.name));
  ASSERT_EQ(frame.ParticleCount(), kParticles);
  // The table has seven digits.
  for (std::size_t k = 0; k < truth.positions.size(); ++k) {
    ASSERT_NEAR(frame.positions[k], truth.positions[k], 1e-6) << k;
  }
  EXPECT_EQ(frame.float32, sample.float32);
  EXPECT_EQ(frame.time.has_value(), sample.has_time);
  if (sample.has_time) {
    EXPECT_EQ(frame.time, 1.0);
  }
  ASSERT_EQ(frame.velocities.size(), sample.has_velocities ? 2 * kParticles : 0);
  for (std::size_t k = 0; k < frame.velocities.size(); ++k) {
    ASSERT_NEAR(frame.velocities[k], truth.velocities[k], 1e-5) << k;
  }
}

std::string NameOf(const testing::TestParamInfo<Sample>& info) {
  std::string name = info.param.name;
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Arrays, Samples,
                         testing::Values(Sample{"pos_f4_fortran.npy", true, false, false},
                                         Sample{"binary_le.ply", true, false, false},
                                         Sample{"frame_deflate.npz", true, false, false}),
                         NameOf);

#ifdef PARTIEMC_HAVE_VTK
INSTANTIATE_TEST_SUITE_P(Vtk, Samples,
                         testing::Values(Sample{"appended_raw_lz4.vtp", true, true, true},
                                         Sample{"appended_raw_zlib_u64.vtp", true, true, true},
                                         Sample{"appended_raw_bigendian.vtu", false, true, true},
                                         Sample{"inline_base64_zlib.vtp", true, true, true},
                                         Sample{"polydata_v51_binary.vtk", true, true, true},
                                         Sample{"ugrid_v42_binary.vtk", false, true, true}),
                         NameOf);
#endif

}  // namespace
}  // namespace partiemc::client
