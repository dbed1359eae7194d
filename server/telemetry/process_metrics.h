// What the system tells about this process, under the names that Prometheus's libraries share.
#pragma once

#include <prometheus/metric_family.h>

#include <string>
#include <vector>

namespace partiemc::server {

/// Memory, processor time, threads and file descriptors; those that /proc does not tell are absent.
std::vector<prometheus::MetricFamily> ProcessFamilies();

/// A family of one gauge without labels.
prometheus::MetricFamily GaugeFamily(const std::string& name, const std::string& help,
                                     double value);

}  // namespace partiemc::server
