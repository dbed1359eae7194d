// The core against VTK, on the same data in the same run, one thread each.
#pragma once

#include <memory>

#include "bench/core_stream.h"
#include "bench/harness.h"
#include "bench/peers.h"
#include "bench/report.h"
#include "bench/scenes.h"

namespace partiemc::bench {

class PeerMeasures {
 public:
  /// Both must outlive the measures.
  PeerMeasures(const ReferenceScenes& scenes, bool quick, Harness& harness);

  /// After the harness has run and CoreMeasures have been added.
  void AddTo(Report& report) const;

 private:
  Harness& harness_;
  LatticeBox field_box_;
  std::unique_ptr<SphFieldPeer> sph_;
  std::unique_ptr<CoreStream> contours_;  // Default parameters.
  std::unique_ptr<CoreStream> linear_;    // Marching squares, no mesh: what VTK's contour is.
  std::unique_ptr<CoreStream> filled_;    // Marching squares, `polygon`: what VTK's filling is.
  std::unique_ptr<ContourPeer> vtk_contours_;
  std::unique_ptr<FillPeer> vtk_fill_;
};

}  // namespace partiemc::bench
