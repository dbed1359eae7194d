// The first page of the report: the machine in general words, and the figures to look at first.
#pragma once

#include <string>

#include "bench/report.h"

namespace partiemc::bench {

/// "2 processors, AVX2, ...": what figures depend on, and nothing that names a machine.
std::string DescribeMachine();

/// The opening of bench.md for what `report` holds.
Report Summarise(const Report& report, bool quick, int repetitions);

}  // namespace partiemc::bench
