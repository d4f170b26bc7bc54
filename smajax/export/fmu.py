"""A block as a functional mock-up unit (FMI 2.0 or 3.0, co-simulation): description, sources and a binary for this machine, zipped.

Nothing of Python is in it. What stands in `c/` beside this file is the interface; the block itself is the C of `source`.
"""

from __future__ import annotations

import hashlib
import io
import os
import platform
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path

from smajax.core.provenance import made_with
from smajax.export.errors import ExportError
from smajax.export.model_description import FMI3, Variables, build_description, model_description
from smajax.export.source import CSource, number

HERE = Path(__file__).parent / "c"
VERSIONS = ("2.0", "3.0")
FLAGS: tuple[str, ...] = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off")
KINDS = {
    "parameter": ("UNIT_PARAMETER", "state.parameters"),
    "input": ("UNIT_INPUT", "inputs"),
    "output": ("UNIT_OUTPUT", "outputs"),
}


def compiler() -> str:
    """The C compiler: $CC, cc, gcc or clang. Raises ExportError without one."""
    named = os.environ.get("CC", "")
    for name in (named, "cc", "gcc", "clang"):
        if name and shutil.which(name):
            return name
    raise ExportError(
        "a binary needs a C compiler, and there is none (cc, gcc, clang or the one that CC names): install one, or export the sources "
        "alone (`--source-only`), which the importing tool compiles."
    )


def platform_of(version: str) -> tuple[str, str]:
    """(folder of the binary of this machine, end of its name)."""
    system, machine = platform.system(), platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    ends = {"Linux": ".so", "Darwin": ".dylib", "Windows": ".dll"}
    if version != FMI3 and machine == "x86_64" and system in ends:
        return {"Linux": "linux64", "Darwin": "darwin64", "Windows": "win64"}[system], ends[system]
    return f"{machine}-{system.lower()}", ends.get(system, ".so")


def _token(source: CSource, version: str) -> str:
    """The same for the same unit, another for any other."""
    mark = hashlib.sha256("\0".join([version, source.header, source.source]).encode()).hexdigest()
    return f"{{{mark[:8]}-{mark[8:12]}-{mark[12:16]}-{mark[16:20]}-{mark[20:32]}}}"


def _block_header(source: CSource, token: str) -> str:
    """block.h: which block the interface is for."""
    name, period = source.name, source.block.period
    inputs = "&(data)->inputs, " if source.inputs else ""
    given = f"(&(data)->state, {inputs}&(data)->outputs"
    mark = hashlib.sha256(token.encode()).hexdigest()[:16]
    run = (
        f"#define UNIT_RUN(data) {name}_run{given})"
        if period
        else f"#define UNIT_RUN(data, seconds) {name}_run{given}, seconds)"
    )
    lines = [
        f"/* Which block this unit is of: {name}. Written by smajax. */",
        "#ifndef SMAJAX_BLOCK_H",
        "#define SMAJAX_BLOCK_H",
        "",
        f'#include "{name}.h"',
        "",
        f"typedef {name}_state block_state;",
        f"typedef {name}_outputs block_outputs;",
        f"typedef {name}_inputs block_inputs;" if source.inputs else "typedef double block_inputs;",
        f"#define block_init {name}_init",
        f'#define UNIT_TOKEN "{token}"',
        f"#define UNIT_MARK UINT64_C(0x{mark})",
        f"#define UNIT_SAMPLED {int(period is not None)}",
        *([f"#define UNIT_PERIOD {number(period)}"] if period else [f"#define UNIT_START(data) {name}_start{given})"]),
        run,
        "",
        "#endif",
        "",
    ]
    return "\n".join(lines)


def _variables_header(source: CSource) -> str:
    """variables.h: where each variable lies, by value reference."""
    rows = ['    {"time", UNIT_TIME, offsetof(unit_data, time), 0.0, -INFINITY, INFINITY},']
    for one, causality in Variables(source).rows:
        kind, where = KINDS[causality]
        values = ", ".join(number(value) for value in (one.start, one.low, one.high))
        rows.append(f'    {{"{one.name}", {kind}, offsetof(unit_data, {where}.{one.c_name}), {values}}},')
    lines = [
        f"#define UNIT_VARIABLES {len(rows)}",
        "",
        "static const struct unit_variable unit_variables[UNIT_VARIABLES] = {",
        *rows,
        "};",
        "",
    ]
    return "\n".join(lines)


def _sources(source: CSource, version: str, token: str) -> dict[str, str]:
    interface = "fmi3.c" if version == FMI3 else "fmi2.c"
    shared = {name: (HERE / name).read_text("utf-8") for name in ("unit.h", "unit.c", interface)}
    return {
        f"{source.name}.h": source.header,
        f"{source.name}.c": source.source,
        "block.h": _block_header(source, token),
        "variables.h": _variables_header(source),
        **shared,
    }


def built(sources: dict[str, str], name: str, end: str) -> bytes:
    """The shared library of some sources. Raises ExportError with what the compiler said."""
    with tempfile.TemporaryDirectory() as folder:
        for file, text in sources.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        files = [file for file in sources if file.endswith(".c")]
        command = [compiler(), *FLAGS, *files, "-o", f"{name}{end}", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise ExportError(f"the C compiler failed ({' '.join(command[:1])}): {done.stderr.strip()[-2000:]}")
        return (Path(folder) / f"{name}{end}").read_bytes()


def fmu(source: CSource, version: str = "2.0", binary: bool = True) -> bytes:
    """The file of the unit. binary: with one for this machine; without, the importing tool compiles the sources.

    Raises ExportError for a version that there is not, and where the binary cannot be made.
    """
    if version not in VERSIONS:
        raise ExportError(f"FMI {version!r} is not written; expected {' or '.join(VERSIONS)}.")
    token, made = _token(source, version), made_with()
    sources = _sources(source, version, token)
    files = [file for file in sources if file.endswith(".c")]
    tool = f"smajax {made.get('smajax', '')}".strip()
    content: dict[str, bytes] = {
        "modelDescription.xml": model_description(source, version, token, tool, files).encode(),
        **{f"sources/{file}": text.encode() for file, text in sources.items()},
        "documentation/index.html": _page(source).encode(),
    }
    if version == FMI3:
        content["sources/buildDescription.xml"] = build_description(source.name, files).encode()
    if binary:
        folder, end = platform_of(version)
        content[f"binaries/{folder}/{source.name}{end}"] = built(sources, source.name, end)
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in content.items():
            # One date for all: the same unit is the same file.
            entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if path.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, data)
    return held.getvalue()


def _page(source: CSource) -> str:
    """What the unit is, for a reader of its documentation."""
    from html import escape

    rows = "".join(
        f"<tr><td>{escape(one.name)}</td><td>{causality}</td><td>{escape(one.unit)}</td><td>{one.start:.6g}</td><td>{escape(one.about)}</td></tr>"
        for one, causality in Variables(source).rows
    )
    about = (
        ""
        if source.block.period is None
        else f"<p>It acts every {source.block.period:g} s and holds its outputs in between.</p>"
    )
    return (
        f"<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'><title>{escape(source.name)}</title></head><body>"
        f"<h1>{escape(source.block.title)}</h1>{about}<table border='1'><tr><th>name</th><th>kind</th><th>unit</th><th>start</th><th>meaning</th></tr>"
        f"{rows}</table></body></html>\n"
    )
