#include "fuzz/targets.h"

namespace partiemc::fuzz {

std::span<const Target> AllTargets() {
  static constexpr Target kTargets[] = {
      {"bgeo", AttackBgeo},
      {"checkpoint", AttackCheckpoint},
      {"config", AttackConfig},
      {"expressions", AttackExpressions},
      {"frame_message", AttackFrameMessage},
      {"frames", AttackFrames},
      {"gateway_bytes", AttackGatewayBytes},
      {"gsd", AttackGsd},
      {"hdf5", AttackHdf5},
      {"lammps_dump", AttackLammpsDump},
      {"npy", AttackNpy},
      {"npz", AttackNpz},
      {"packed", AttackPacked},
      {"parts_over_connections", AttackPartsOverConnections},
      {"pickle", AttackPickle},
      {"ply", AttackPly},
      {"recording", AttackRecording},
      {"relay_messages", AttackRelayMessages},
      {"relay_peers", AttackRelayPeers},
      {"result_message", AttackResultMessage},
      {"sections", AttackSections},
      {"state", AttackState},
      {"stream_requests", AttackStreamRequests},
      {"surfaces", AttackSurfaces},
      {"text_table", AttackTextTable},
      {"tokens", AttackTokens},
#ifdef PARTIEMC_HAVE_VTK
      {"vtk", AttackVtk},
#endif
      {"watch_requests", AttackWatchRequests},
      {"web_requests", AttackWebRequests},
      {"xyz", AttackXyz},
  };
  return kTargets;
}

}  // namespace partiemc::fuzz
