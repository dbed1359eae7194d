#!/bin/bash
# Builds the Debian packages of this architecture into DIR (default: build/debian/packages):
# partiemc-server, partiemc, libpartiemc-c1, libpartiemc-dev and python3-partiemc; and the Python
# wheel.
#   docker/install.sh debian && docker/debian/build.sh [DIR]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$(realpath -m "${1:-build/debian/packages}")

cmake -S . -B build/debian -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr \
  -DPARTIEMC_TESTS=OFF -DPARTIEMC_VTK=OFF -DPARTIEMC_HDF5=OFF -DPARTIEMC_VIEWER=ON -DPARTIEMC_C=ON -DPARTIEMC_PYTHON=ON \
  -DPARTIEMC_DEBIAN=ON
cmake --build build/debian
mkdir -p "$out"
rm -f "$out"/*.deb
(cd build/debian && cpack -G DEB -B "$out" >cpack.log) || { cat build/debian/cpack.log >&2; exit 1; }
rm -rf "$out/_CPack_Packages"
rm -f "$out"/*.whl
/usr/bin/python3 client/python/make_wheel.py build/debian/python "$out" >/dev/null
ls -sh "$out"
