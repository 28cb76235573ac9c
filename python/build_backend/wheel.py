# SPDX-License-Identifier: Apache-2.0
"""What `pip install .` calls (PEP 517): CMake builds the package and its libraries into a wheel. It needs
no other Python package, so no network. build/release is used again where it is there."""
import base64
import hashlib
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / "release"


def _version():
    return re.search(r"project\(hapsix VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def _tag():
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _call(*words):
    subprocess.run([str(word) for word in words], check=True, cwd=ROOT)


def _install(to):
    """The package with the engine's libraries beside its module, below `to`."""
    # The interpreter that asked: in pip's isolated environment sys.executable is the right one.
    _call("cmake", "-S", ROOT, "-B", BUILD, "-DCMAKE_BUILD_TYPE=Release", "-DHAPSIX_PYTHON=ON",
          f"-DPython3_EXECUTABLE={os.path.realpath(sys.executable)}")
    _call("cmake", "--build", BUILD, "--target", "hapsix_python", "--parallel", os.cpu_count() or 1)
    for component in ("libhapsix0", "libhapsix-io0", "python3-hapsix"):
        _call("cmake", "--install", BUILD, "--prefix", to, "--component", component, "--strip")
    package = next(to.rglob("dist-packages/hapsix"))
    for library in to.rglob("lib*/**/*.so.0"):
        (package / library.name).write_bytes(library.resolve().read_bytes())
    return package


def _metadata():
    return {
        "METADATA": (f"Metadata-Version: 2.1\nName: hapsix\nVersion: {_version()}\nSummary: 6-DoF haptic rendering\n"
                     "License: Apache-2.0\nRequires-Python: >=3.9\nRequires-Dist: numpy\n").encode(),
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
        "WHEEL": f"Wheel-Version: 1.0\nGenerator: hapsix\nRoot-Is-Purelib: false\nTag: {_tag()}\n".encode()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    info = pathlib.Path(metadata_directory) / f"hapsix-{_version()}.dist-info"
    info.mkdir()
    for name, data in _metadata().items():
        (info / name).write_bytes(data)
    return info.name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    name = f"hapsix-{_version()}-{_tag()}.whl"
    info = f"hapsix-{_version()}.dist-info"
    with tempfile.TemporaryDirectory() as folder:
        package = _install(pathlib.Path(folder))
        files = {f"hapsix/{f.name}": f.read_bytes() for f in sorted(package.iterdir()) if f.is_file()}
    files.update({f"{info}/{file}": data for file, data in _metadata().items()})
    record = ""
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / name, "w", zipfile.ZIP_DEFLATED) as wheel:
        for path, data in files.items():
            wheel.writestr(path, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(data)}\n"
        wheel.writestr(f"{info}/RECORD", record + f"{info}/RECORD,,\n")
    return name


def build_sdist(sdist_directory, config_settings=None):
    raise NotImplementedError("install from a checkout of the tree: pip install .")
