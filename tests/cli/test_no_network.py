"""Nothing is fetched at run time: every command works in an empty network namespace, and none asks for a connection."""

from __future__ import annotations

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
from smajax.cli.main import main
try:
    main()
finally:
    print("asked of the network:", asked, file=sys.stderr)
"""
COMMANDS = (
    "presets",
    "effects",
    "simulate flexinol_table_3_2 dead_weight flexinol_voltage --step 5V:1s --out {out}/run",
    "new-experiment {out}/log.csv --out {out}/begun.toml",
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


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_needs_no_network_and_asks_for_none(tmp_path: Path, command: str, without_network: list[str]) -> None:
    experiment = bench(tmp_path / "bench")
    log(tmp_path / "log.csv")
    words = command.format(bench=experiment, out=tmp_path).split()
    ended = subprocess.run(
        [*without_network, sys.executable, "-c", WATCHED, *words], capture_output=True, text=True, timeout=300
    )
    assert ended.returncode == 0, ended.stderr
    assert "asked of the network: []" in ended.stderr


def test_a_namespace_without_network_has_none(without_network: list[str]) -> None:
    """The test of the test: in there a connection fails, and the watcher sees it."""
    code = WATCHED.replace("from smajax.cli.main import main", "import socket").replace(
        "main()", "socket.create_connection(('192.0.2.1', 80), timeout=5)"
    )
    ended = subprocess.run([*without_network, sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert ended.returncode != 0
    assert "unreachable" in ended.stderr
    assert "socket.connect" in ended.stderr
