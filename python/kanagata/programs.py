"""The two programs that the wheel installs beside the interpreter."""

import os
import shutil
import sysconfig


def program(name: str = "kanagata-solve") -> str:
    """Path of ``kanagata`` or ``kanagata-solve``: of this installation, or else the first in PATH.

    :raises FileNotFoundError: neither is there.
    """
    if name not in ("kanagata", "kanagata-solve"):
        raise ValueError(f"program {name!r}; allowed: kanagata, kanagata-solve")
    file = name + (".exe" if os.name == "nt" else "")
    for scheme in (None, "posix_user" if os.name == "posix" else "nt_user"):
        folder = sysconfig.get_path("scripts", scheme) if scheme else sysconfig.get_path("scripts")
        own = os.path.join(folder, file)
        if os.access(own, os.X_OK):
            return own
    found = shutil.which(file)
    if found is None:
        raise FileNotFoundError(f"{name} is neither beside this interpreter nor in PATH; install the wheel again")
    return found
