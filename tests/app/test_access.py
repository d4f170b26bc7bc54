"""Who may use the server of the app, and which files it touches."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from smajax.app.confined import OutsideError, inside
from smajax.app.project import EXPERIMENT, read_project
from smajax.app.server import bound, make_app
from tests.app.conftest import TOKEN


def stranger(folder: Path, host: str = "127.0.0.1:8000") -> TestClient:
    return TestClient(make_app(folder, TOKEN), base_url=f"http://{host}")


@pytest.mark.parametrize("address", ["/folder", "/stamp", "/static/app.js", "/file/first.csv", "/?token=wrong"])
def test_without_the_token_nothing_is_served(folder: Path, address: str) -> None:
    answer = stranger(folder).get(address)
    assert answer.status_code == 403
    assert "the address that `smajax app` printed" in answer.text


def test_the_token_goes_from_the_address_into_a_cookie_that_scripts_cannot_read(folder: Path) -> None:
    answer = stranger(folder).get(f"/logs?token={TOKEN}&folder=", follow_redirects=False)
    assert answer.headers["location"] == "/logs?folder="
    cookie = answer.headers["set-cookie"].lower()
    assert cookie.startswith("smajax_8000=")
    assert "httponly" in cookie
    assert "samesite=lax" in cookie


def test_a_name_that_leads_to_the_loopback_and_a_form_of_another_page_are_refused(
    folder: Path, client: TestClient
) -> None:
    assert stranger(folder, "evil.example:8000").get(f"/?token={TOKEN}").status_code == 403
    answer = client.post("/folder", data={"name": "new"}, headers={"origin": "http://evil.example"})
    assert answer.status_code == 403
    assert not (folder / "new").exists()
    own = client.post("/folder", data={"name": "new"}, headers={"origin": "http://127.0.0.1:8000"})
    assert own.status_code == 200
    assert (folder / "new").is_dir()


def test_the_server_listens_on_the_loopback_alone() -> None:
    with bound(0) as listening:
        assert listening.getsockname()[0] == "127.0.0.1"


def test_paths_out_of_the_folder_and_links_that_lead_out_are_refused(folder: Path, client: TestClient) -> None:
    secret = folder.parent / "secret.csv"
    secret.write_text("t,U,x\n0,1,2\n1,1,2\n", encoding="utf-8")
    (folder / "link.csv").symlink_to(secret)
    (folder / "away").symlink_to(folder.parent)
    (folder / ".hidden").write_text("no", encoding="utf-8")
    (folder / "loop").symlink_to(folder / "loop")
    for path in ("../secret.csv", "link.csv", "away/secret.csv", str(secret), ".hidden", "loop", "a\0b"):
        with pytest.raises(OutsideError):
            inside(folder.resolve(), path)
    assert inside(folder.resolve(), "first.csv") == folder.resolve() / "first.csv"
    for address in (
        "/file/link.csv",
        "/file/away/secret.csv",
        "/file/%2e%2e/secret.csv",
        "/folder?folder=../",
        "/folder?folder=away",
    ):
        assert client.get(address).status_code == 403, address
    assert client.get("/series", params={"log": "link.csv", "column": "x"}).status_code == 403
    assert client.get("/file/first.csv").status_code == 200
    project = read_project(folder.resolve(), "")
    assert [one.name for one in project.log_paths] == ["first.csv", "second.csv", "third.csv"]


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('folder = "."', 'folder = ".."', "data.folder"),
        ('file = "first.csv"', 'file = "../secret.csv"', "runs.first.file"),
    ],
)
def test_an_experiment_that_reads_files_elsewhere_is_refused(
    folder: Path, drafted: TestClient, old: str, new: str, key: str
) -> None:
    (folder.parent / "secret.csv").write_text("t,U,x\n0,1,2\n1,1,2\n", encoding="utf-8")
    path = folder / EXPERIMENT
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    found = read_project(folder.resolve(), "").examined
    assert found.experiment is None
    assert "reads no files outside it" in found.errors[key]
    answer = drafted.post("/fit", data={"do": "start"})
    assert answer.status_code == 422
    assert not (folder / "report").exists()


def test_a_page_of_a_command_cannot_reach_the_server(folder: Path, client: TestClient) -> None:
    (folder / "report").mkdir()
    (folder / "report" / "report.html").write_text("<script>1</script>", encoding="utf-8")
    answer = client.get("/file/report/report.html")
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts")
    assert "allow-same-origin" not in policy
    assert "connect-src" not in policy  # and so none of `default-src 'none'`


def test_names_of_files_and_headings_are_text_on_the_pages(folder: Path, client: TestClient) -> None:
    hostile = '<img src=x onerror="window.hacked=1">'
    (folder / "odd.csv").write_text(f'"{hostile}",b\n0,1\n1,2\n', encoding="utf-8")
    text = client.get("/logs").text
    assert "odd.csv" in text
    assert "<img" not in text
    assert json.loads(client.get("/stamp").text)["stamp"]
