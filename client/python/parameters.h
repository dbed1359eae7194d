// Converts keyword arguments to parameters and options. Each Take function removes the arguments it
// uses, and requests all of its arguments in every call, so that NamesTakenBy lists them.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>

#include "client/python/arguments.h"
#include "partiemc/client/stream.h"
#include "partiemc/client/watcher.h"
#include "partiemc/parameters.h"

namespace partiemc::python {

/// Removes the reconstruction parameters from `arguments` and converts them; None means not given.
/// Raises partiemc.Error for a value of the wrong form, such as an unknown placement or a `slice`
/// that is no pair, and for surfaces and slices without a spacing. Raises TypeError for an argument
/// of the wrong type.
ReconstructionParameters TakeParameters(Arguments& arguments);
/// Converts a dict of periodic axes with their bounds: {"x": (0, 10)}. Raises partiemc.Error for
/// another dict.
PeriodicBox BoxOf(const pybind11::dict& given);
/// The reverse of BoxOf; None without a box.
pybind11::object ToPython(const std::optional<PeriodicBox>& box);
/// Removes tls, ca_file, cert_file, key_file, token and token_file from `arguments` and converts
/// them. The defaults come from the environment. ca_file and cert_file enable TLS, unless `tls` is
/// False.
client::Credentials TakeCredentials(Arguments& arguments);
/// Removes all options of a stream, including parameters, from `arguments` and converts them.
/// `latest`: the producer skips frames, so the default of give_up_after is shorter.
client::StreamOptions TakeStreamOptions(Arguments& arguments, bool latest);
client::WatcherOptions TakeWatcherOptions(Arguments& arguments);

/// Converts parameters to a dict with the names of the keyword arguments.
pybind11::dict ToDict(const ReconstructionParameters& parameters);

}  // namespace partiemc::python
