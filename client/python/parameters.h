// Keyword arguments as parameters and options.
#pragma once

#include <pybind11/pybind11.h>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/parameters.h"

namespace partiemc::python {

/// Takes the parameters of a reconstruction out of `arguments`; None counts as not given.
/// Raises partiemc.Error for a name that no parameter has, TypeError for a value of another kind.
ReconstructionParameters TakeParameters(pybind11::dict arguments);
/// Takes tls, ca_file, cert_file, key_file, token and token_file. Whoever names a certificate wants
/// TLS.
client::Credentials TakeCredentials(pybind11::dict arguments);
/// Takes all else that a stream may be opened with, parameters included. `latest`: of a producer
/// that skips frames.
client::StreamOptions TakeStreamOptions(pybind11::dict arguments, bool latest);
client::WatcherOptions TakeWatcherOptions(pybind11::dict arguments);
/// Raises TypeError where something is left.
void ExpectNothingElse(const pybind11::dict& arguments, const char* function);

/// What parameters are, by the names that they are given by.
pybind11::dict Told(const ReconstructionParameters& parameters);

}  // namespace partiemc::python
