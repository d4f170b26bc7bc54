"""Disks that are full, folders that may not be written, another result, another program, no memory: what is said, and what stays."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from smajax.cli.result_folder import LOCK, MARK, FolderTaken, claimed
from smajax.core.files import replace, writing
from smajax.core.result_cache import ResultCache
from tests.helpers.small_bench import bench, log, refused, smajax

pytestmark = pytest.mark.usefixtures("blank_pictures")

WIRE = ("flexinol_table_3_2", "dead_weight", "flexinol_voltage", "--step", "5V:1s")


@pytest.fixture(autouse=True, scope="module")
def programs_of_their_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A program that is killed, or has no room, may leave half a compiled one behind: not where other tests read theirs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path_factory.mktemp("programs")))
        yield


def _python(code: str, *words: str | Path, before: str = "", **more: object) -> subprocess.CompletedProcess[str]:
    """A program of its own; `before`: what a shell does first."""
    command = [sys.executable, "-c", code, *map(str, words)]
    if before:
        command = ["sh", "-c", f'{before}; exec "$0" "$@"', *command]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, **more)  # type: ignore[call-overload]


@pytest.fixture(scope="module")
def small_disk() -> list[str]:
    """How to begin a program that has a file system of its own; the test skips where a user may not mount one."""
    mount = shutil.which("unshare")
    words = [mount or "unshare", "--user", "--map-root-user", "--mount"]
    tried = mount and subprocess.run([*words, "sh", "-c", "mount -t tmpfs none /mnt"], capture_output=True)
    if not tried or tried.returncode:
        pytest.skip("no user namespaces here, by which a small disk could be mounted")
    return words


def test_a_file_that_cannot_be_written_to_its_end_leaves_the_one_before(tmp_path: Path) -> None:
    """A cap on the size of files stands for any write that fails in the middle."""
    path = replace(tmp_path / "report.json", "before")
    code = (
        "import sys\nfrom pathlib import Path\nfrom smajax.core.files import replace\n"
        "replace(Path(sys.argv[1]), 'x' * 100_000)"
    )
    ended = _python(code, path, before="ulimit -f 8")  # blocks of 512 bytes
    assert ended.returncode == 1
    assert "File too large" in ended.stderr
    assert path.read_text() == "before"
    assert [one.name for one in tmp_path.iterdir()] == ["report.json"]


def test_a_command_reports_a_full_disk_and_resumes_when_there_is_room(tmp_path: Path) -> None:
    """In this process once its programs are compiled, which have room: half of one would stay for all tests."""
    assert smajax("simulate", *WIRE, "--out", tmp_path / "before").code == 0
    out = tmp_path / "out"
    free = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, free[1]))
    try:
        said = refused("simulate", *WIRE, "--out", out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, free)
    assert "File too large: free some space and give the same command again. Finished results are cached." in said
    assert not list(tmp_path.rglob("*.part"))
    assert smajax("simulate", *WIRE, "--out", out).code == 0
    assert (out / "simulate.csv").read_bytes() == (tmp_path / "before" / "simulate.csv").read_bytes()


@pytest.mark.slow
def test_a_full_disk_is_reported(tmp_path: Path, small_disk: list[str]) -> None:
    code = "import sys; sys.argv = ['smajax', 'simulate', *sys.argv[1:]]; from smajax.cli.main import main; main()"
    inside = 'mount -t tmpfs -o size=16k none "$0" || exit 99; "$@"; code=$?; ls -A "$0/out"; exit $code'
    words = [sys.executable, "-c", code, *WIRE, "--out", str(tmp_path / "out")]
    ended = subprocess.run([*small_disk, "sh", "-c", inside, str(tmp_path), *words], capture_output=True, text=True)
    assert ended.returncode == 2, ended.stderr
    assert "No space left on device: free some space and give the same command again." in ended.stderr
    assert "Traceback" not in ended.stderr
    assert ".part" not in ended.stdout


def test_a_read_only_folder_is_reported_before_the_work(tmp_path: Path, small_disk: list[str]) -> None:
    (tmp_path / "disk" / "out").mkdir(parents=True)
    code = (
        "import sys\nfrom smajax.cli.main import main\n_, disk, *words = sys.argv\n"
        "for out in ('out', 'deep/out'):\n    sys.argv = ['smajax', 'simulate', *words, '--out', f'{disk}/{out}']\n"
        "    try:\n        main()\n    except SystemExit as end:\n        print(end.code)"
    )
    inside = 'mount -t tmpfs none "$0" && mkdir "$0/out" && mount -o remount,ro "$0" || exit 99; "$@"'
    command = [sys.executable, "-c", code, str(tmp_path / "disk"), *WIRE]
    told = subprocess.run(
        [*small_disk, "sh", "-c", inside, str(tmp_path / "disk"), *command], capture_output=True, text=True
    )
    assert told.stdout.split() == ["2", "2"], told.stderr
    assert "cannot be written to (Read-only file system)" in told.stderr
    assert "cannot be created (Read-only file" in told.stderr
    assert "Traceback" not in told.stderr


def test_an_impossible_folder_is_reported(tmp_path: Path) -> None:
    said = refused("simulate", *WIRE, "--out", "/proc/no/such")
    assert "--out /proc/no/such cannot be created" in said
    (tmp_path / "file").write_text("mine")
    assert "is a file; give the name of a folder" in refused("simulate", *WIRE, "--out", tmp_path / "file" / "out")


def test_another_result_is_refused_and_overwritten_when_asked(tmp_path: Path) -> None:
    assert smajax("simulate", *WIRE, "--out", tmp_path).code == 0
    before = (tmp_path / "simulate.csv").read_bytes()
    for words in (
        ["simulate", *WIRE[:-1], "4V:1s"],
        ["sweep", "--controllers", "pid"],
        ["tune", "pid"],
        ["figures", "M9"],
    ):
        said = refused(*words, "--out", tmp_path)
        assert "result of `smajax simulate`" in said
        assert "give the name of another folder, or --overwrite to delete that" in said
    experiment = bench(tmp_path / "bench")
    for command in ("identify", "close-loop"):
        assert "a result of `smajax simulate`" in refused(command, experiment, "--out", tmp_path)
    assert (tmp_path / "simulate.csv").read_bytes() == before
    assert smajax("simulate", *WIRE[:-1], "4V:1s", "--out", tmp_path, "--overwrite").code == 0
    assert (tmp_path / "simulate.csv").read_bytes() != before


def test_two_programs_never_write_into_one_folder(tmp_path: Path) -> None:
    """The second is refused while the first is at work, and goes on when it has ended, even by kill -9."""
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom smajax.cli.result_folder import claimed\n"
        "with claimed(Path(sys.argv[1]), 'sweep', {}, []):\n    print('in', flush=True)\n    time.sleep(60)"
    )
    out = tmp_path / "out"
    with subprocess.Popen([sys.executable, "-c", code, str(out)], stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "in\n"
        (out / ".sweep.json.k3j2.part").write_text("half")
        with (
            pytest.raises(FolderTaken, match="another smajax is writing into it; wait until it has ended"),
            claimed(out, "sweep", {}, []),
        ):
            pass
        assert "another smajax is writing into it" in refused("sweep", "--controllers", "pid", "--out", out)
        first.kill()
    with claimed(out, "sweep", {}, []):
        assert sorted(one.name for one in out.iterdir()) == [
            MARK,
            LOCK,
        ]  # what the killed one left half written is gone


def test_damaged_cached_work_is_computed_again(tmp_path: Path) -> None:
    kept = ResultCache(tmp_path)
    kept.save("a" * 32, {"values": np.arange(1000.0)})
    path = tmp_path / f"{'a' * 32}.npz"
    whole = path.read_bytes()
    assert kept.load("a" * 32) is not None
    for content in (b"", whole[:100], whole[:-30], whole[:60] + b"\xff" * 200 + whole[260:], b"PK\x03\x04"):
        path.write_bytes(content)
        assert ResultCache(tmp_path).load("a" * 32) is None
    with writing(path) as file:
        np.savez(file, object=np.array([{}], dtype=object))
    assert ResultCache(tmp_path).load("a" * 32) is None  # pickled: never opened


@pytest.mark.slow
def test_a_cap_on_memory_makes_chunks_smaller(tmp_path: Path) -> None:
    """The same sweep with all the memory there is and with little: more chunks, the same numbers."""
    code = """
import resource, sys
import numpy as np
from smajax.core.runtime import prepare
prepare()
import jax
from smajax.simulation.batch.axes import grid
from smajax.simulation.batch.chunks import chunks
from smajax.simulation.batch import run_batch as run
from smajax.model.presets import build
system = build("flexinol_table_3_2", "dead_weight", "flexinol_voltage")
axes = grid(voltage=np.linspace(3.0, 6.0, 512))
run.run_batch(system, {}, grid(voltage=[5.0] * 512), seconds=20.0, dt=0.05, keep=("temperature",))  # compiled before the cap
sizes = []
whole = run.chunk_size
run.chunk_size = lambda *asked: sizes.append(whole(*asked)) or sizes[-1]
if sys.argv[1] != "0":
    used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + int(sys.argv[1]),) * 2)
found = run.run_batch(system, {}, axes, seconds=20.0, dt=0.05, keep=("temperature",))
print(sizes[0], float(np.sum(found["temperature"].values)))
"""
    if not Path("/proc/self/statm").exists():
        pytest.skip("no /proc, by which the memory in use is known")
    ended = [_python(code, str(cap)) for cap in (0, 12 << 20)]
    assert [one.returncode for one in ended] == [0, 0], ended[1].stderr[-2000:]
    (all_at_once, total), (fewer, same) = (one.stdout.split() for one in ended)
    assert int(fewer) < int(all_at_once)
    assert total == same


def test_a_clock_that_is_set_back_loses_no_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ResultCache work is known by its content, so a file from the future is as good as another."""
    kept = ResultCache(tmp_path)
    kept.save("b" * 32, {"values": np.arange(3.0)})
    os.utime(tmp_path / f"{'b' * 32}.npz", (4e9, 4e9))
    found = ResultCache(tmp_path).load("b" * 32)
    assert found is not None
    np.testing.assert_array_equal(found["values"], np.arange(3.0))
    log(tmp_path / "a.csv")
    monkeypatch.setattr("time.time", lambda: 0.0)
    assert smajax("new-experiment", tmp_path / "a.csv", "--out", tmp_path / "experiment.toml").code == 0
