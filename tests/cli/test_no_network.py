"""Nothing is fetched at run time: every command works in an empty network namespace, and none asks for a connection."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.small_bench import bench, log

# An audit hook sees each look-up and connection that Python makes, also one whose failure is passed over in silence.
WATCHED = """
import sys
asked = []
def watch(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.sendto", "urllib.Request"):
        asked.append((event, str(arguments[-1])))
sys.addaudithook(watch)
"""
# All commands in one process: its imports take longer than they do.
ALL = (
    WATCHED
    + """
import contextlib, io, json
from smajax.cli.main import main
ended = {}
for command in json.loads(sys.argv[1]):
    said, code = io.StringIO(), 0
    sys.argv = ["smajax", *command.split()]
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    ended[command] = [code, said.getvalue(), list(asked)]
    asked.clear()
print(json.dumps(ended))
"""
)
QUICK = ("presets", "effects")
LONG = (
    "new-experiment {out}/log.csv --out {out}/begun.toml",
    "simulate flexinol_table_3_2 dead_weight flexinol_voltage --step 5V:1s --out {out}/run",
    "identify {bench} --starts 0 --out {out}/identified",
    "figures M9 --fast --no-open --out {out}/figures",
)


@pytest.fixture(scope="module")
def without_network() -> list[str]:
    """How to begin a program without any network; the test skips where a user may not."""
    words = [shutil.which("unshare") or "unshare", "--user", "--map-root-user", "--net"]
    try:
        allowed = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    except FileNotFoundError:
        allowed = False
    if not allowed:
        pytest.skip("no user namespaces here, by which a program could be kept from the network")
    return words


@pytest.mark.parametrize("commands", [QUICK, pytest.param(LONG, marks=pytest.mark.slow)], ids=["quick", "long"])
def test_commands_need_no_network_and_ask_for_none(
    commands: tuple[str, ...], without_network: list[str], tmp_path: Path
) -> None:
    """Of each command: its exit code, what it printed, and what it asked of the network."""
    experiment = bench(tmp_path / "bench")
    log(tmp_path / "log.csv")
    words = [command.format(bench=experiment, out=tmp_path) for command in commands]
    asked = [*without_network, sys.executable, "-c", ALL, json.dumps(words)]
    ended = subprocess.run(asked, capture_output=True, text=True, timeout=300)
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout)
    assert {word: (code, told_of) for word, (code, _, told_of) in told.items()} == {word: (0, []) for word in words}, (
        told
    )
    assert all(printed for _, printed, _ in told.values())


def test_a_namespace_without_network_has_none(without_network: list[str]) -> None:
    """The test of the test: in there a connection fails, and the watcher sees it."""
    code = f"""{WATCHED}
import socket
try:
    socket.create_connection(("192.0.2.1", 80), timeout=5)
finally:
    print("asked of the network:", asked, file=sys.stderr)
"""
    ended = subprocess.run([*without_network, sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert ended.returncode != 0
    assert "unreachable" in ended.stderr
    assert "socket.connect" in ended.stderr
