"""Build the message packages that the wheels of ROS 2 lack, and our own, with the wheels' rosidl tools.

Run by `make test-ros2` with the Python of its environment: ``build_interfaces.py FOLDER...``.
Each folder is an ament_cmake package.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np

PREFIX = Path(sys.prefix)
# The wheels' CMake files name the Python of the machine that built them.
BUILT_WITH = "/opt/python/cp312-cp312"


def main(packages: list[str]) -> None:
    include = Path(sysconfig.get_path("include"))
    if not (include / "Python.h").exists():
        sys.exit(f"make test-ros2: {include} has no Python.h; install python3.12-dev, or use a Python of pyenv or uv")
    if shutil.which("c++") is None:
        sys.exit("make test-ros2: there is no C++ compiler; install g++")
    for exported in PREFIX.glob("share/*/cmake/*.cmake"):
        text = exported.read_text()
        if BUILT_WITH in text:
            numpys = f"{BUILT_WITH}/lib/python3.12/site-packages/numpy/_core/include"
            text = text.replace(numpys, np.get_include()).replace(f"{BUILT_WITH}/include/python3.12", str(include))
            exported.write_text(text)
    environment = {**os.environ, "AMENT_PREFIX_PATH": str(PREFIX), "PATH": f"{PREFIX / 'bin'}:{os.environ['PATH']}"}
    for package in packages:
        build = PREFIX / "build" / Path(package).name
        settings = [
            f"-DCMAKE_INSTALL_PREFIX={PREFIX}", f"-DCMAKE_PREFIX_PATH={PREFIX}",
            f"-DPython3_EXECUTABLE={sys.executable}", "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_TYPE=None",
        ]  # fmt: skip
        for command in (
            ["cmake", "-S", package, "-B", build, "-G", "Ninja", "-Wno-dev", "--log-level=WARNING", *settings],
            ["cmake", "--build", build, "--target", "install"],
        ):
            done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
            if done.returncode:
                sys.exit(f"{package} cannot be built:\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}")


if __name__ == "__main__":
    main(sys.argv[1:])
