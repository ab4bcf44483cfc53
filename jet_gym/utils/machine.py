"""The machine on which something was measured, in words."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_PACKAGES = ("numpy", "numba", "llvmlite", "gymnasium", "pybullet", "pin", "pymoo", "deap", "cmaes")


def machine(use_of_cores: str = "") -> dict[str, str]:
    """Describe the machine by what matters to speed, and by nothing that tells whose it is.

    Args:
        use_of_cores: How many of the cores were used, in words.
    """
    processor = _processor()
    flags = processor.get("flags", "").split()
    simd = next((bits for flag, bits in (("avx512f", 512), ("avx2", 256), ("sse2", 128)) if flag in flags), 0)
    packages = [f"{name} {number}" for name in _PACKAGES if (number := _version(name))]
    return {
        "processor": processor.get("model name", platform.processor() or platform.machine()),
        "cores": ", ".join(filter(None, (str(os.cpu_count()), use_of_cores))),
        "SIMD": f"{simd} bit" if simd else "unknown",
        "system": f"{platform.system()} {platform.machine()}",
        "Python": f"{platform.python_implementation()} {platform.python_version()}",
        "packages": ", ".join(packages),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _processor() -> dict[str, str]:
    """Return what Linux says of the first core."""
    source = Path("/proc/cpuinfo")
    if not source.is_file():
        return {}
    pairs = (line.partition(":") for line in source.read_text().split("\n\n")[0].splitlines())
    return {name.strip(): value.strip() for name, _, value in pairs}
