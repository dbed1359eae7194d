// Converts keyword arguments to parameters and options. Each Take function removes the arguments it
// uses.
#pragma once

#include <pybind11/pybind11.h>

#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/parameters.h"

namespace partiemc::python {

/// Takes the reconstruction parameters; None means not given. Raises partiemc.Error if a value is
/// an unknown name, for example of a placement. Raises TypeError for a value of the wrong type.
ReconstructionParameters TakeParameters(pybind11::dict arguments);
/// Converts a dict of periodic axes with their bounds. Raises partiemc.Error for another dict.
PeriodicBox BoxOf(const pybind11::dict& given);
/// Takes tls, ca_file, cert_file, key_file, token and token_file. Setting a certificate enables
/// TLS.
client::Credentials TakeCredentials(pybind11::dict arguments);
/// Takes all options of a stream, including parameters. `latest`: the producer skips frames.
client::StreamOptions TakeStreamOptions(pybind11::dict arguments, bool latest);
client::WatcherOptions TakeWatcherOptions(pybind11::dict arguments);
/// Raises TypeError if arguments are left.
void ExpectNothingElse(const pybind11::dict& arguments, const char* function);

/// Converts parameters to a dict with the names of the keyword arguments.
pybind11::dict ToDict(const ReconstructionParameters& parameters);

}  // namespace partiemc::python
