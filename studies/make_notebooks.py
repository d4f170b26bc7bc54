"""Write the notebooks with their outputs from the sources that are edited: `python -m studies.make_notebooks [NUMBER...]`, or `make notebooks`.

`notebooks/NN_name.py` is edited; `notebooks/NN_name.ipynb` is made of it: paired by jupytext, run by Jupyter in a new process, with its
outputs. 05 and 07 need the measured data (`SMAJAX_DATA`). Cells tagged `skip-execution` are for a reader's own machine.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "notebooks"
LARGEST = 3_000_000  # bytes of all notebooks together
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def source(path: Path) -> Any:
    """The notebook that a source says, without outputs; the same for the same source."""
    import jupytext

    notebook = jupytext.read(path, fmt="py:percent")
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"{path.stem[:2]}-{number:02d}"
    notebook["metadata"] = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
    notebook["nbformat"], notebook["nbformat_minor"] = 4, 5
    return notebook


def executed(path: Path) -> Any:
    """The same with outputs. RuntimeError where a cell writes to stderr; nbclient's error where one fails."""
    from nbclient import NotebookClient

    notebook = source(path)
    NotebookClient(notebook, timeout=1800, record_timing=False, resources={"metadata": {"path": str(FOLDER)}}).execute()
    for cell in notebook.cells:
        cell["metadata"] = {name: value for name, value in cell["metadata"].items() if name == "tags"}
        for output in cell.get("outputs", ()):
            if output.get("name") == "stderr":
                raise RuntimeError(f"{path.name} writes to stderr, which a reader would see:\n{output['text']}")
            if "image/png" in output.get("data", {}):
                output["data"] = {"image/png": output["data"]["image/png"]}
                output["metadata"] = {}
    notebook["metadata"] = {"kernelspec": KERNEL, "language_info": {"name": "python"}}
    return notebook


def main() -> None:
    import nbformat

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("numbers", nargs="*", type=int, metavar="NUMBER", help="of a notebook; none: all of them")
    asked = parser.parse_args().numbers
    for path in sorted(FOLDER.glob("*.py")):
        if asked and int(path.stem[:2]) not in asked:
            continue
        notebook = executed(path)
        nbformat.validate(notebook)
        nbformat.write(notebook, path.with_suffix(".ipynb"))
        print(path.with_suffix(".ipynb").name, flush=True)
    size = sum(one.stat().st_size for one in FOLDER.glob("*.ipynb"))
    print(f"{size / 1e6:.2f} MB")
    if size > LARGEST:
        sys.exit(
            f"got {size / 1e6:.2f} MB of notebooks, expected at most {LARGEST / 1e6:g}; draw fewer or smaller pictures"
        )


if __name__ == "__main__":
    main()
