// Metrics of this process, read from /proc, under the names that Prometheus's client libraries use.
#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace partiemc::server {

/// Returns memory, processor time, threads and file descriptors. Omits metrics that /proc does not
/// provide.
std::vector<prometheus::MetricFamily> ProcessFamilies();

}  // namespace partiemc::server
