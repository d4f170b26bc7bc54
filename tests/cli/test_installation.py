"""`smajax doctor` and `bench`: what they say is so."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from smajax.cli import installation as doctor
from smajax.cli.benchmark import benchmark
from smajax.cli.commands.bench import as_lines
from smajax.cli.commands.doctor import lines_of
from smajax.cli.main import app

run = CliRunner()
PLAIN = {name: value for name, value in os.environ.items() if name != "JAX_ENABLE_X64"}


def test_the_doctor_finds_what_is_missing() -> None:
    found = doctor.examine()
    assert found["float64"]
    assert found["engine"] == {"runs": "native", "why": "", "vector_bits": found["engine"]["vector_bits"]}
    assert found["engine"]["vector_bits"] in (128, 256, 512)
    assert found["packages"]["jax"]
    assert found["memory"]["available_bytes"] is None or found["memory"]["available_bytes"] > 1 << 20
    ill = {**found, "float64": False, "packages": {**found["packages"], "optax": ""}}
    ill["compiled programs"] = {**found["compiled programs"], "writable": False}
    told = " ".join(doctor.remarks(ill))
    assert "optax is not installed" in told
    assert "jax_enable_x64" in told
    assert "JAX_COMPILATION_CACHE_DIR" in told


@pytest.mark.parametrize(
    ("usable", "said"),
    [(1, "1 core that this process may use, of 8"), (8, "8 cores"), (3, "3 cores that this process may use, of 8")],
)
def test_the_doctor_says_which_cores_it_counts(monkeypatch: pytest.MonkeyPatch, usable: int, said: str) -> None:
    monkeypatch.setattr("smajax.core.machine.available_cores", lambda: usable)
    monkeypatch.setattr("os.cpu_count", lambda: 8)
    assert lines_of(doctor.examine(engine=False))[1].endswith(f", {said}")


def test_the_doctor_does_not_ask_for_developers_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = [
        "jax>=0.7",
        "h5py>=3.11; extra == 'dev'",
        "h5py>=3.11; extra == 'formats'",
        "jax[cuda12]>=0.7; extra == 'cuda12'",
    ]
    lines += ["mkdocs<2; extra == 'docs'", 'no-such-tool>=9.0; python_version > "3" and extra == "dev"']
    monkeypatch.setattr("importlib.metadata.requires", lambda package: lines)
    found = doctor.examine(engine=False)
    assert set(found["packages"]) == {"jax"}
    assert set(found["packages of extras"]) == {"h5py"}


def test_the_doctor_reports_float64_for_commands_and_for_programs() -> None:
    """Without what it says to do, a program of one's own has float32; with it, float64."""
    told = run.invoke(app, ["doctor"]).output
    assert "float64: on in the commands; a program of your own switches it on itself" in told
    assert "smajax.prepare()" in told
    shown = "print(jax.numpy.zeros(1).dtype)"
    for lines, expected in ((shown, "float32"), (f"smajax.prepare(); {shown}", "float64")):
        words = [sys.executable, "-c", f"import jax, smajax; {lines}"]
        ended = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True, env=PLAIN)
        assert ended.stdout.strip() == expected


def test_only_compiled_programs_are_cleared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path))
    (tmp_path / "jit_f-abc-cache").write_bytes(b"x" * 1000)
    (tmp_path / "lanes").mkdir()
    (tmp_path / "lanes" / ("0a" * 32)).write_bytes(b"x" * 500)
    (tmp_path / "lanes" / "notes").write_text("mine")
    (tmp_path / "native").mkdir()
    (tmp_path / "native" / ("0b" * 32)).write_bytes(b"x" * 500)
    (tmp_path / "thesis.tex").write_text("mine")
    assert doctor.clear_cache() == 2000
    assert sorted(one.name for one in tmp_path.rglob("*")) == ["lanes", "native", "notes", "thesis.tex"]


def test_the_bench_compares_the_same_trajectories() -> None:
    found = benchmark(count=64, peers=2)
    assert found["agree"]
    assert 0.0 < found["largest_difference_degrees"] < 0.1
    assert found["ratio"] == pytest.approx(found["scipy_ms"] / found["smajax_ms"])
    assert found["machine"]["processor"] in as_lines(found)[0]
