// Metrics of this process from /proc, with the usual names of Prometheus's libraries.
#pragma once

#include <prometheus/metric_family.h>

#include <string>
#include <vector>

namespace partiemc::server {

/// Memory, processor time, threads and file descriptors; without those that /proc lacks.
std::vector<prometheus::MetricFamily> ProcessFamilies();

/// A metric family with one gauge, without labels.
prometheus::MetricFamily GaugeFamily(const std::string& name, const std::string& help,
                                     double value);

}  // namespace partiemc::server
