"""The package of the source's figures: `studies/source` of a checkout, `smajax_studies` beside smajax in a wheel.

A person who installs smajax expects `smajax figures` to work, since README and `smajax --help` name it, and does not expect a
top-level package with a name as common as `studies`. The wheel therefore has the figures as `smajax_studies`. They are
loaded from their place beside smajax and never searched for on the path: a folder `studies` of the user's own is not taken,
and a checkout does not get the figures of another version that is installed.
"""

from __future__ import annotations

import importlib
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

NAME = "smajax_studies"
PLACES = (Path(NAME), Path("studies", "source"))  # below the folder that smajax lies in
MODULES = ("catalogue", "write")  # what the command needs of them


def load(module: str, root: Path = Path(__file__).parents[2]) -> ModuleType:
    """A module of that package (`catalogue`, `write`). Raises FileNotFoundError, with what to do, where there is none."""
    folders = [root / place for place in PLACES]
    folder = next((one for one in folders if all((one / f"{name}.py").is_file() for name in MODULES)), None)
    if folder is None:
        raise FileNotFoundError(
            f"the source's figures are not installed: neither {folders[0]} nor {folders[1]} has them. Install smajax anew from "
            "its wheel (pip install --force-reinstall smajax), or run the command in a checkout of its repository."
        )
    start = folder / "__init__.py"
    package = sys.modules.get(NAME)
    if package is None or package.__file__ != str(start):
        for name in [name for name in sys.modules if name.partition(".")[0] == NAME]:
            del sys.modules[name]
        spec = spec_from_file_location(NAME, start, submodule_search_locations=[str(folder)])
        assert spec is not None
        assert spec.loader is not None
        package = sys.modules[NAME] = module_from_spec(spec)
        spec.loader.exec_module(package)
    return importlib.import_module(f"{NAME}.{module}")
