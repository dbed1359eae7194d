#include "fuzz/targets.h"

namespace partiemc::fuzz {

std::span<const Target> AllTargets() {
  static constexpr Target kTargets[] = {
      {"checkpoint", AttackCheckpoint},
      {"expressions", AttackExpressions},
      {"frame_message", AttackFrameMessage},
      {"frames", AttackFrames},
      {"lammps_dump", AttackLammpsDump},
      {"npy", AttackNpy},
      {"npz", AttackNpz},
      {"packed", AttackPacked},
      {"recording", AttackRecording},
      {"result_message", AttackResultMessage},
      {"state", AttackState},
      {"text_table", AttackTextTable},
      {"xyz", AttackXyz},
  };
  return kTargets;
}

}  // namespace partiemc::fuzz
