"""What the site takes from the repository when it is built, and its equations as MathML: nothing is stored twice.

A page links a file of the repository by its path, so that the link also works in the repository (`../tests/x.py`).
Pages and pictures of `studies/` become part of the site, and so do the notebooks with their stored outputs; any other text file
that a page links becomes a page that shows it. A broken link ends the build.

A page of the reference names modules (`::: smajax.control.compose`). Each of them gets a page of its own, and the page that names it a table
that leads there. The options of each command are a page too, as `--help` prints them.
"""

from __future__ import annotations

import ast
import html
import os
import posixpath
import re
from functools import cache
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from nbconvert import MarkdownExporter
from typer.testing import CliRunner

from smajax.cli.main import app

ROOT = Path(__file__).parents[1]
TAKEN = (
    "studies/*.md",
    "studies/*/README.md",
    "studies/attribution_benchmark/results*.md",
    "studies/benchmarks/results/*/README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
)
PICTURES = ("studies/*.png", "studies/*/*.png", "docs/*.png", "docs/*.svg")
LINK = re.compile(r"(\]\()([^)#\s]+)((?:#[^)\s]*)?\))")
LABELLED = re.compile(r"\[([^\[\]]*)\]\(([^)#\s]+)\)")
FENCED = re.compile(r"^(```|~~~).*?^\1[ \t]*$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"(?:^::: \S+\n+)+", re.MULTILINE)  # modules in a row
ANCHOR = re.compile(r"(\]\()#(smajax\.[^)\s]+)\)")
MODULES, HELP = "reference/modules", "reference/commands"
# How a search ranks a page whose words fit as well: what a reader looks for first, and what stands behind it.
BOOSTS = (
    ("how-to/", 4.0),
    ("start/", 4.0),
    ("tutorial", 4.0),
    ("notebooks/", 1.5),
    (f"{MODULES}/", 0.01),
    ("studies/", 0.4),
    ("C", 0.3),
)
# Pages of many parts of which a reader looks for one: each is folded away. Where a part begins; its title is the group `title`.
FOLDED = {
    "studies/chapter3/README.md": re.compile(r"^## (?P<title>M\d+)\n", re.MULTILINE),
    "studies/chapter4/README.md": re.compile(r"^## (?P<title>C\d+)\n", re.MULTILINE),
    "CHANGELOG.md": re.compile(r"^(?P<title>[A-Z][^\n]*):\n(?=\n- )", re.MULTILINE),
}
SOURCED = re.compile(r" \((?:Fig|sec|eq|Table)\b|\n")  # what stands before it says what the part is of
ENDS = re.compile(r"^#{2,3} ", re.MULTILINE)  # of a folded part, beside the begin of the next one
MATHS = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
# Where the reference shows a module that no page names: on the page of its folder, the longest that fits.
PAGE_OF = {
    "smajax": "names",
    "smajax.core": "core",
    "smajax.engine": "engine",
    "smajax.model": "loads-and-drives",
    "smajax.model.wire": "wire",
    "smajax.model.effects": "effects",
    "smajax.simulation": "simulation",
    "smajax.simulation.batch": "batches",
    "smajax.data": "experiments",
    "smajax.fit": "fits",
    "smajax.control": "control",
    "smajax.attribution": "attribution",
    "smajax.report": "reports",
    "smajax.cli": "commands",
}
LANGUAGES = {".py": "python", ".toml": "toml", ".json": "json", ".slurm": "bash", ".cpp": "cpp", ".yml": "yaml"}


def place(path: str) -> str:
    """Where a file of the repository lies in the site, as a source."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if Path(path).suffix == ".png" or any(Path(path).match(one) for one in TAKEN):
        return path
    if path.endswith(".ipynb"):
        return path.replace(".ipynb", ".md")
    # A page of its own by a command (`studies/sweep/index.html`) would lie where its README's does.
    if path.endswith(".html"):
        return path.replace("index.html", "page.html")
    return f"repository/{path.removeprefix('.')}.md"  # a folder that begins with a dot has no place in a site


def linked(page: str, text: str) -> list[str]:
    """Paths in the repository that a page of it links. PluginError for one that is not there."""
    found = []
    for _, target, _ in LINK.findall(FENCED.sub("", text)):
        if "://" in target or target.startswith("mailto:"):
            continue
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), target))
        if not (ROOT / path).exists():
            raise PluginError(f"{page} links {target}, and there is no {path}")
        found.append(path)
    return found


def notebook_files(config: Any, path: Path) -> list[File]:
    """A notebook as a page with its outputs, its pictures, and the notebook itself to download."""
    here, prefix = path.relative_to(ROOT).as_posix(), f"{path.stem}_"
    text, resources = MarkdownExporter().from_filename(
        str(path), resources={"unique_key": path.stem, "output_files_dir": ""}
    )
    title, _, rest = text.strip().partition("\n")
    source = path.with_suffix(".py").name
    note = (
        f'<p class="quiet">A notebook with its outputs: <a href="{path.name}" download>download {path.name}</a>; edited as '
        f"<code>notebooks/{source}</code>.</p>"
    )
    page = File.generated(config, place(here), content=f"{title}\n\n{note}\n\n{rest}\n")
    pictures = [
        File.generated(config, f"notebooks/{Path(name).name}", content=content)
        for name, content in resources["outputs"].items()
    ]
    assert all(Path(one.src_uri).name.startswith(prefix) for one in pictures), [one.src_uri for one in pictures]
    return [page, *pictures, File.generated(config, here, abs_src_path=str(path))]


def on_files(files: Files, config: Any) -> Files:
    """Add what the pages of the site and of the studies link, a page for each module and one for each command."""
    taken = [path.relative_to(ROOT).as_posix() for one in TAKEN for path in sorted(ROOT.glob(one))]
    taken += [path.relative_to(ROOT).as_posix() for one in PICTURES for path in sorted(ROOT.glob(one))]
    pages = [f"docs/{file.src_uri}" for file in files.documentation_pages()]
    pages += [path for path in taken if path.endswith(".md")]
    more = [path for page in pages for path in linked(page, (ROOT / page).read_text(encoding="utf-8"))]
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        for file in notebook_files(config, path):
            files.append(file)
    for path in dict.fromkeys([*taken, *more]):
        source = ROOT / path
        if source.is_dir() or files.get_file_from_path(place(path)) is not None:
            continue
        if place(path).startswith("repository/"):
            text = source.read_text(encoding="utf-8")
            shown = f"---\nsearch: {{ exclude: true }}\n---\n# `{path}`\n\n````{LANGUAGES.get(source.suffix, 'text')}\n{text}\n````\n"
            files.append(File.generated(config, place(path), content=shown))
        else:
            files.append(File.generated(config, place(path), abs_src_path=str(source)))
    for room in [file for file in files.documentation_pages() if file.src_uri.startswith("reference/")]:
        title = room.content_string.partition("# ")[2].partition("\n")[0]
        names = [*re.findall(r"^::: (\S+)$", room.content_string, re.MULTILINE), *unlisted(room.src_uri, files)]
        back = os.path.relpath(room.src_uri, MODULES)
        for name in names:
            text = f"---\ntitle: {name}\n---\n[{title}]({back}) (advanced reference)\n\n::: {name}\n    options:\n      heading_level: 1\n"
            files.append(File.generated(config, f"{MODULES}/{name}.md", content=text))
    for name, text in helps().items():
        files.append(File.generated(config, f"{HELP}/{name}.md", content=text))
    return files


@cache
def helps() -> dict[str, str]:
    """Of each command a page with what its `--help` prints."""
    pages = {}
    for command in app.registered_commands:
        name = str(command.name)
        text = CliRunner().invoke(app, [name, "--help"]).output.replace("Usage: root ", "Usage: smajax ").strip()
        pages[name] = f"# smajax {name}\n\n[All commands](../commands.md)\n\n```text\n{text}\n```\n"
    return pages


@cache
def modules() -> dict[str, str]:
    """The first sentence of every module's docstring."""
    found = {}
    for path in sorted((ROOT / "smajax").rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        found[name] = " ".join(said.split("\n\n")[0].split()).replace("|", "\\|")
    return found


def module_table(names: list[str]) -> str:
    """What stands on a page in the place of modules that it names."""
    rows = [f"| [`{name}`](modules/{name}.md) | {modules().get(name, '')} |" for name in names]
    return "\n".join(["", "| module | |", "|---|---|", *rows, ""])


def page_of_anchor(anchor: str) -> str:
    """The page that has `smajax.control.compose.compose`, which is that of its module."""
    parts = anchor.split(".")
    return next(name for k in range(len(parts), 0, -1) if (name := ".".join(parts[:k])) in modules())


def unlisted(source: str, files: Files) -> list[str]:
    """Modules that belong to this page of the reference and that no page names, so that a new one is never left out."""
    pages = [file for file in files.documentation_pages() if posixpath.dirname(file.src_uri) == "reference"]
    text = "\n".join(file.content_string for file in pages)
    listed = set(re.findall(r"^::: (\S+)$", text, re.MULTILINE))
    paths = [path.relative_to(ROOT).with_suffix("") for path in sorted((ROOT / "smajax").rglob("*.py"))]
    names = [".".join(path.parts) for path in paths if not path.name.startswith("_")]

    def page(name: str) -> str:
        return PAGE_OF[max((folder for folder in PAGE_OF if name.startswith(f"{folder}.")), key=len)]

    return [name for name in names if name not in listed and f"reference/{page(name)}.md" == source]


def origin(source: str) -> str:
    """The inverse of `place`, for a page."""
    if source.startswith("notebooks/"):
        return source
    return source if any(Path(source).match(one) for one in TAKEN) else f"docs/{source}"


def folded(text: str, begins: re.Pattern[str]) -> str:
    """`text` with each part in a box that opens at a click. Its heading is in the box: a link that leads to it opens the box."""
    found = list(begins.finditer(text))
    if not found:
        raise PluginError(f"nothing to fold: no {begins.pattern} in a page that is listed in FOLDED")
    pieces = [text[: found[0].start()]]
    for one, after in zip(found, [*(one.start() for one in found[1:]), len(text)], strict=True):
        end = ENDS.search(text, one.end(), after)
        stop = end.start() if end else after
        body = text[one.end() : stop].strip()
        said = one["title"] if one[0].endswith(":\n") else f"{one['title']}: {SOURCED.split(body, maxsplit=1)[0]}"
        head = "" if one[0].endswith(":\n") else one[0]
        pieces.append(
            f'<details markdown="1"><summary>{html.escape(said)}</summary>\n\n{head}\n{body}\n\n</details>\n\n{text[stop:after]}'
        )
    return "".join(pieces)


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Links of the repository as links of the site, a folder's as plain text; a page of the reference with all its modules."""
    here = page.file.src_uri
    if here.startswith("repository/"):
        return markdown
    page.meta.setdefault("search", {"boost": next((boost for begin, boost in BOOSTS if here.startswith(begin)), 1.0)})
    if posixpath.dirname(here) in (MODULES, HELP):
        return markdown
    if posixpath.dirname(here) == "reference":
        markdown += "\n" + "".join(f"::: {name}\n\n" for name in unlisted(here, files))
        markdown = NAMED.sub(lambda run: module_table(re.findall(r"\S+\.\S+|smajax", run[0])), markdown)
        if here == "reference/commands.md":
            markdown += (
                "\n## Options of each command\n\n"
                + ", ".join(f"[`{name}`](commands/{name}.md)" for name in helps())
                + "\n"
            )
    if here in FOLDED:
        markdown = folded(markdown, FOLDED[here])
    mine = origin(here)

    def path_of(target: str) -> str:
        return posixpath.normpath(posixpath.join(posixpath.dirname(mine), target))

    def unlinked(match: re.Match[str]) -> str:
        return match[1] if (ROOT / path_of(match[2])).is_dir() else match[0]

    def led(match: re.Match[str]) -> str:
        before, target, after = match.groups()
        if "://" in target or target.startswith("mailto:"):
            return match[0]
        if after.startswith("#smajax."):
            return f"{before}{module_link(after[1:-1])})"
        return f"{before}{os.path.relpath(place(path_of(target)), posixpath.dirname(here) or '.')}{after}"

    def module_link(anchor: str) -> str:
        page = f"{MODULES}/{page_of_anchor(anchor)}.md"
        return f"{os.path.relpath(page, posixpath.dirname(here) or '.')}#{anchor}"

    def changed(text: str) -> str:
        here_or_there = ANCHOR.sub(lambda match: f"{match[1]}{module_link(match[2])})", text)
        return LINK.sub(led, LABELLED.sub(unlinked, here_or_there))

    fences = list(FENCED.finditer(markdown))
    parts, at = [], 0
    for fence in fences:
        parts += [changed(markdown[at : fence.start()]), fence[0]]
        at = fence.end()
    return "".join([*parts, changed(markdown[at:])])


def on_page_content(content: str, page: Any, config: Any, files: Files) -> str:
    """LaTeX as MathML, which browsers render without a library."""

    def shown(match: re.Match[str]) -> str:
        text = html.unescape(match[2]).strip()
        block = text.startswith("\\[")
        drawn = convert(text[2:-2].strip(), display="block" if block else "inline")
        return f'<div class="maths">{drawn}</div>' if block else drawn

    return MATHS.sub(shown, content)
