"""The app in this process, for a folder with small logs."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="smajax app needs the extra `app`")

with warnings.catch_warnings():
    warnings.simplefilter(
        "ignore"
    )  # of httpx, in whose place the newest Starlette likes a package that older ones do not know
    from starlette.testclient import TestClient

from smajax.app import ready
from smajax.app.server import make_app
from tests.helpers.small_bench import log

TOKEN = "of-the-test"


@pytest.fixture(scope="session", autouse=True)
def loaded() -> None:
    """JAX is prepared for all tests, and cannot be prepared twice."""
    ready._DONE.append(True)
    ready.warm()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three logs with headings t, U and x without units."""
    root = tmp_path / "bench"
    root.mkdir()
    for number, name in enumerate(("first", "second", "third")):
        log(root / f"{name}.csv", seconds=12.0, interval=0.1, top=5.0 - 0.5 * number, seed=number)
    return root


@pytest.fixture
def client(folder: Path) -> Iterator[TestClient]:
    """A browser that has the token."""
    with TestClient(make_app(folder, TOKEN), base_url="http://127.0.0.1:8000") as made:
        assert made.get(f"/?token={TOKEN}").status_code == 200
        yield made


@pytest.fixture
def drafted(client: TestClient) -> TestClient:
    """The same after the draft of an experiment file."""
    answer = client.post("/logs", data={"use": ["first.csv", "second.csv", "third.csv"], "do": "draft"})
    assert answer.url.path == "/columns"
    return client
