"""The server: addresses, forms and files, on the loopback."""

from __future__ import annotations

import secrets
import socket
import threading
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote, urlencode

import jinja2
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from smajax.app.access import HEADERS, Access
from smajax.app.confined import OutsideError, inside
from smajax.app.log_files import table_of
from smajax.app.opened import note_opened, opened
from smajax.app.pages import bench, columns, download, fit, folder, logs, predict, result, runs, tune
from smajax.app.plots import series
from smajax.app.project import Examined, Project, read_project
from smajax.app.ready import loaded
from smajax.app.step import FieldError, Sent, Step
from smajax.core.display_units import digits
from smajax.data.readers.table import MeasuredDataError
from smajax.report.frame import TEMPLATES
from smajax.report.plain_page import with_code

HERE = Path(__file__).parent
STEPS: tuple[Step, ...] = (
    folder.STEP,
    logs.STEP,
    columns.STEP,
    bench.STEP,
    runs.STEP,
    fit.STEP,
    result.STEP,
    predict.STEP,
    tune.STEP,
    download.STEP,
)
BY_NAME = {step.name: step for step in STEPS}
WATCHED = {"fit": fit.COMMANDS, "predict": ("predict",), "tune": ("tune",), "download": ("export",)}
# A page that a command wrote: its own scripts and styles, and nothing from anywhere; it cannot reach the pages of the server.
OF_A_REPORT = (
    "sandbox allow-scripts allow-popups allow-downloads allow-modals; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data:; font-src data:"
)


@dataclass(frozen=True)
class Mark:
    """A step in the list on the left."""

    step: Step
    number: int
    current: bool
    done: bool
    wrong: bool
    open: bool


def _marks(project: Project, current: Step, examined: Examined) -> list[Mark]:
    errors = examined.errors
    loads = examined.experiment is not None
    there = {"": True, "experiment": bool(project.text), "loads": loads, "model": bool(predict.models(project))}
    fitted, seen, found = fit.done(project), opened(project.folder), []
    for number, step in enumerate(STEPS, start=1):
        wrong = any(key.split(".")[0] in step.keys for key in errors)
        of_file = bool(step.keys) and bool(project.text) and step.name not in ("fit",)
        done = (of_file and not wrong and (loads or bool(errors))) if step.needs == "experiment" else step.done(project)
        # A fit that was made without the page says as much of the steps before it.
        done = done and (not step.to_look_at or step.name in seen or (step.needs == "experiment" and fitted))
        found.append(Mark(step, number, step is current, done, wrong, there[step.needs]))
    return found


class Pages:
    """Templates, and what every one of them can call."""

    def __init__(self) -> None:
        self.environment = jinja2.Environment(
            # The head of a page is that of the reports.
            loader=jinja2.FileSystemLoader([HERE / "templates", TEMPLATES]),
            autoescape=True,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self.environment.filters["digits"] = lambda value: digits(value, 4)
        self.environment.filters["with_code"] = with_code

    def html(
        self, template: str, project: Project, step: Step, wrong: Mapping[str, str], sent: Sent | None = None
    ) -> str:
        """The page of a step. wrong: messages by field, beside those of the experiment file."""
        examined = project.examined if loaded() else Examined(None, {})
        errors = {**examined.errors, **wrong}
        marks = _marks(project, step, examined)
        of_step = {mark.step.name: mark.step.keys for mark in marks}

        def url(name: str, **more: str) -> str:
            query = {**({"folder": project.own} if project.own else {}), **more}
            return f"/{quote(name)}" + (f"?{urlencode(query)}" if query else "")

        def under(key: str) -> list[str]:
            return [text for name, text in errors.items() if name == key or name.startswith(f"{key}.")]

        def home(key: str) -> Step | None:
            return next((BY_NAME[name] for name, keys in of_step.items() if key.split(".")[0] in keys), None)

        following = STEPS[STEPS.index(step) + 1] if step is not STEPS[-1] else None
        shared = {
            "project": project,
            "step": step,
            "marks": marks,
            "errors": errors,
            "wrong": wrong,
            "under": under,
            "home": home,
            "url": url,
            "entries": sent.values if sent else {},
            "next": following,
            "open": not loaded() or next(mark.open for mark in marks if mark.step is step),
        }
        waits = not (loaded() or step.light)
        own: Mapping[str, object] = {} if waits else step.page(project)
        template = "wait.html" if waits else template
        assert not shared.keys() & own.keys(), f"{step.name}: a name of the frame"
        return self.environment.get_template(template).render({**shared, **own})


def _page(pages: Pages, project: Project, step: Step, wrong: Mapping[str, str], sent: Sent | None = None) -> Response:
    return HTMLResponse(pages.html(f"{step.name}.html", project, step, wrong, sent), 422 if wrong else 200, HEADERS)


class Server:
    """What the addresses answer, for projects in `root` (resolved)."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.pages = Pages()

    def project(self, request: Request) -> Project:
        return read_project(self.root, request.query_params.get("folder", ""))

    def show(self, request: Request) -> Response:
        """A step's page."""
        step = BY_NAME.get(request.path_params["step"])
        if step is None:
            return PlainTextResponse("no such page", 404)
        project = self.project(request)
        if step.to_look_at and project.text:
            note_opened(project.folder, step.name)
        return _page(self.pages, project, step, {})

    async def change(self, request: Request) -> Response:
        """A step's form; then its page, or that of the step that follows."""
        step = BY_NAME.get(request.path_params["step"])
        if step is None:
            return PlainTextResponse("no such page", 404)
        async with request.form(max_files=1000, max_fields=10000) as form:
            values: dict[str, str] = {}
            several: dict[str, list[str]] = {}
            files = []
            for name, value in form.multi_items():
                if isinstance(value, UploadFile):
                    files += [(value.filename or "", value.file)] if value.filename else []
                else:
                    values[name] = value
                    several.setdefault(name, []).append(value)
            sent = Sent(values, several, files)
            return await run_in_threadpool(self._changed, request, step, sent)

    def _changed(self, request: Request, step: Step, sent: Sent) -> Response:
        project = self.project(request)
        try:
            go = step.save(project, sent)
        except FieldError as error:
            return _page(self.pages, self.project(request), step, {error.field: str(error)}, sent)
        if "?" in go:
            return RedirectResponse(f"/{go}", 303, HEADERS)
        query = f"?{urlencode({'folder': project.own})}" if project.own else ""
        return RedirectResponse(f"/{go or step.name}{query}", 303, HEADERS)

    def stamp(self, request: Request) -> Response:
        """What a page compares to know that something has changed."""
        return JSONResponse({"stamp": self.project(request).stamp}, headers=HEADERS)

    def series(self, request: Request) -> Response:
        """A column of a log, to be drawn."""
        project, query = self.project(request), request.query_params
        key: str | int = query.get("column", "")
        key = int(key) if str(key).isdigit() else key
        try:
            table = table_of(project.log_at(query.get("log", "")), project.decimal)
            return JSONResponse(series(table, key, query.get("unit", ""), project.counted_step), headers=HEADERS)
        except MeasuredDataError as error:
            return JSONResponse({"error": str(error)}, 422, HEADERS)

    def watch(self, request: Request) -> Response:
        """The part of a page that a running command changes."""
        project = self.project(request)
        step = BY_NAME.get(request.path_params["step"])
        if step is None or step.name not in WATCHED:
            return PlainTextResponse("no such page", 404)
        context = fit.watch(project, WATCHED[step.name])
        template = self.pages.environment.get_template("watch.html")
        return HTMLResponse(template.render(project=project, step=step, **context), headers=HEADERS)

    def errors(self, request: Request) -> Response:
        """The errors of the runs since the start of the fit."""
        return JSONResponse(fit.errors_plot(self.project(request)), headers=HEADERS)

    def influences(self, request: Request) -> Response:
        """Which preset values matter most."""
        found = bench.influences(self.project(request))
        return JSONResponse({**found, "stamp": self.project(request).stamp}, headers=HEADERS)

    def file(self, request: Request) -> Response:
        """A file of the project: shown where it is a page of a command, else sent."""
        project = self.project(request)
        path = inside(self.root, (project.folder / request.path_params["path"]).as_posix())
        if not path.is_file():
            return PlainTextResponse("there is no such file", 404)
        headers = {**HEADERS, "Content-Security-Policy": OF_A_REPORT}
        if path.suffix in (".html", ".png", ".gif") and "save" not in request.query_params:
            return FileResponse(path, headers=headers)
        return FileResponse(path, headers=headers, filename=path.name)


def _guarded(answer: Callable[[Request], Response]) -> Callable[[Request], Awaitable[Response]]:
    """Run in a thread, so that no request waits for another; 403 for what is outside the folder."""

    async def endpoint(request: Request) -> Response:
        try:
            return await run_in_threadpool(answer, request)
        except OutsideError as error:
            return PlainTextResponse(str(error), 403)

    return endpoint


def make_app(root: Path, token: str) -> Starlette:
    """The application for the folder `root`; requests need the token."""
    server = Server(root.resolve())

    async def change(request: Request) -> Response:
        try:
            return await server.change(request)
        except OutsideError as error:
            return PlainTextResponse(str(error), 403)

    async def home(request: Request) -> Response:
        return RedirectResponse("/folder", 303)

    return Starlette(
        routes=[
            Route("/", home),
            # Colours and plots are those of the reports.
            Mount("/static", StaticFiles(directory=HERE / "static", packages=[("smajax.report", "static")])),
            Route("/stamp", _guarded(server.stamp)),
            Route("/series", _guarded(server.series)),
            Route("/errors", _guarded(server.errors)),
            Route("/influences", _guarded(server.influences)),
            Route("/watch/{step}", _guarded(server.watch)),
            Route("/file/{path:path}", _guarded(server.file)),
            Route("/{step}", _guarded(server.show), methods=["GET"]),
            Route("/{step}", change, methods=["POST"]),
        ],
        middleware=[Middleware(Access, token=token)],
    )


def bound(port: int) -> socket.socket:
    """A socket on the loopback; port 0: any that is free. Raises OSError where the port is taken."""
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    found.bind(("127.0.0.1", port))
    found.listen(128)  # a browser that is quicker than the server waits
    return found


def serve(root: Path, port: int, started: Callable[[str], None]) -> None:
    """Serve `root` until Ctrl-C. `started` gets the address, with the token, once the socket is bound. Raises OSError for a port that is taken."""
    import uvicorn

    from smajax.app.ready import warm

    token = secrets.token_urlsafe(24)
    listening = bound(port)
    address = f"http://127.0.0.1:{listening.getsockname()[1]}/?{urlencode({'token': token})}"
    threading.Thread(target=warm, daemon=True).start()
    config = uvicorn.Config(make_app(root, token), log_level="error", access_log=False, lifespan="off", ws="none")
    started(address)
    uvicorn.Server(config).run(sockets=[listening])
