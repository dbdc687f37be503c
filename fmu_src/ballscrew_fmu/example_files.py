"""The scripts of the folder `examples`, which a wheel installs beside the package."""

import shutil
import site
import sysconfig
from pathlib import Path

INSTALLED = Path("share", "ballscrew-tehl", "examples")
"""Where a wheel puts them, below the prefix of the environment (pyproject.toml)"""


def examples_folder() -> Path:
    """The folder of the examples: of the source tree, or as installed by a wheel.

    Raises       FileNotFoundError: neither is there
    """
    package = Path(__file__).resolve().parent
    prefixes = sysconfig.get_path("data"), site.getuserbase(), package.parent  # of `pip install --target`
    for folder in (package.parents[1] / "examples", *(Path(prefix, INSTALLED) for prefix in prefixes)):
        if (folder / "torque_over_speed.py").is_file():
            return folder
    raise FileNotFoundError("the examples are not installed: pip install the wheel of ballscrew-tehl")


def copy_examples(folder: Path) -> Path:
    """Copy the examples into a new folder, which is returned.

    Raises       ValueError: the folder has files;  FileNotFoundError: the examples are not installed
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"{folder} exists and is not empty: give a new folder")
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(examples_folder(), folder, ignore=ignored, dirs_exist_ok=True)
    return folder
