// A real server: frames end to end, its peak memory and whether its memory stays.
#pragma once

#include "bench/report.h"
#include "bench/scenes.h"

namespace partiemc::bench {

/// Requires: CoreMeasures have been added to the report.
void MeasureEndToEnd(const ReferenceScenes& scenes, bool quick, Report& report);

void MeasureServerMemory(const ReferenceScenes& scenes, bool quick, Report& report);

}  // namespace partiemc::bench
