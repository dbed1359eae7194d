// Native part of the package, imported by partiemc/__init__.py.
#include <pybind11/pybind11.h>

#include "client/python/reconstruct.h"
#include "client/python/research.h"
#include "client/python/results.h"
#include "client/python/streams.h"
#include "client/python/watch.h"

PYBIND11_MODULE(_native, module) {
  module.attr("version") = PARTIEMC_VERSION;
  partiemc::python::DefineResults(module);
  partiemc::python::DefineReconstructor(module);
  partiemc::python::DefineResearch(module);
  partiemc::python::DefineStreams(module);
  partiemc::python::DefineWatch(module);
}
