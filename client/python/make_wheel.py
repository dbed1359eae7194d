#!/usr/bin/python3
"""Makes a wheel of the built package: make_wheel.py BUILD/python OUTPUT_DIR.

Requires only Python, no network. The wheel works for this Python version and platform. The module
needs Debian's shared libraries (docker/packages/runtime.txt).
"""

import base64
import hashlib
import pathlib
import sys
import sysconfig
import zipfile

SUMMARY = "Temporally stable outlines and light meshes of particles"


def make_wheel(build, output):
    package = pathlib.Path(build) / "partiemc"
    module, = package.glob("_native*.so")
    sys.path.insert(0, str(build))
    from partiemc import __version__ as version

    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"{python}-{python}-{platform}"
    info = f"partiemc-{version}.dist-info"
    files = {f"partiemc/{path.name}": path.read_bytes()
             for path in [module, *sorted(package.glob("*.py*"))] if path.is_file()}
    files["partiemc/py.typed"] = b""
    files[f"{info}/METADATA"] = (f"Metadata-Version: 2.1\nName: partiemc\nVersion: {version}\n"
                                 f"Summary: {SUMMARY}\nLicense: Apache-2.0\nRequires-Python: >=3.9\n"
                                 "Requires-Dist: numpy\n").encode()
    files[f"{info}/WHEEL"] = ("Wheel-Version: 1.0\nGenerator: make_wheel.py\n"
                              f"Root-Is-Purelib: false\nTag: {tag}\n").encode()
    record = ""
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()

    wheel = pathlib.Path(output) / f"partiemc-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            # A fixed date makes builds reproducible.
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.external_attr = 0o100644 << 16
            archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
    return wheel


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    print(make_wheel(*sys.argv[1:]))
