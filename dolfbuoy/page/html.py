"""A self-contained HTML file: style, text, data, script, and a security policy that allows only these.

Anything from a scene enters as escaped text or inside the JSON block, where `<` cannot end it.
"""

import base64
import hashlib
import html
import json
import math
import re
from collections.abc import Iterable
from importlib.resources import files
from typing import Any


class Markup(str):
    """Text that is HTML already."""


def tag(name: str, *children: Any, **attributes: Any) -> Markup:
    """An element; children other than Markup and attributes are escaped.  class_ is class, a_b is a-b."""
    given = "".join(f' {key.strip("_").replace("_", "-")}="{html.escape(str(v))}"' for key, v in attributes.items())
    return Markup(f"<{name}{given}>{joined(children)}</{name}>")


def joined(children: Iterable[Any]) -> Markup:
    """Children joined together."""
    return Markup("".join(c if isinstance(c, Markup) else html.escape(str(c)) for c in children if c is not None))


def page(
    title: str, lines: Iterable[str], *children: Markup | None, data: dict[str, Any] | None = None, script: str = ""
) -> str:
    """HTML of a page: title, lines below it, button for the colours, parts, and data for the script.

    script: name of a module in this folder, included with its imports; without one the page may contain images.
    """
    button = tag("button", "Colours: auto", id="theme", type="button", class_="quiet") if script else None
    top = tag("header", tag("div", tag("h1", title), paragraphs(lines)), button)
    needs = tag("noscript", tag("p", "The replay and the charts need JavaScript, the tables do not.", class_="note"))
    images, needs = ("", needs) if script else ("img-src data:; ", Markup(""))
    style, script = style_sheet(), _with_imports(script) if script else ""
    known = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (style, script)]
    sources = "style-src 'sha256-{}'; script-src 'sha256-{}'".format(*known)
    policy = f"default-src 'none'; {images}{sources}; base-uri 'none'; form-action 'none'"
    parts = {
        "policy": policy,
        "title": html.escape(title),
        "style": style,
        "data": as_json(data or {}),
        "script": script,
    }
    parts["body"] = joined([top, tag("main", *children), needs])
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _read("page.html"))


def style_sheet() -> str:
    """Style of all pages; dark colours by the system's setting or by the button."""
    return _read("page.css").replace("{{dark}}", _read("dark.css"))


def as_json(data: dict[str, Any]) -> str:
    """JSON that is safe inside an HTML element; non-finite numbers become null."""
    text = json.dumps(_finite(data), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def _read(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _with_imports(name: str) -> str:
    """A script module with those that it imports: each once, after those that it needs, without import statements."""
    found = {}

    def add(name: str) -> None:
        code = _read(f"{name}.js")
        for other in re.findall(r'^import [^;]* from "\./(\w+)\.js";$', code, re.MULTILINE):
            if other not in found:
                add(other)
        found[name] = re.sub(r"^import [^;]*;\n|^export (?=class|function|const)", "", code, flags=re.MULTILINE)

    add(name)
    return "\n".join(found.values())


def fragment(name: str, **parts: str) -> Markup:
    """A piece of a page from its file, with texts in its named places."""
    return Markup(re.sub(r"\{\{(\w+)\}\}", lambda found: html.escape(parts[found[1]]), _read(f"{name}.html")))


def section(name: str, title: str, *children: Any, **attributes: Any) -> Markup:
    """A part of the page with its heading."""
    heading = tag("h2", title, id=f"{name}-title")
    return tag("section", heading, *children, id=name, aria_labelledby=f"{name}-title", **attributes)


def table(headings: Iterable[str], rows: Iterable[Iterable[Any]], caption: str = "") -> Markup:
    """A table whose first column heads its rows."""
    head = tag("thead", tag("tr", *(tag("th", text, scope="col") for text in headings)))
    body = [tag("tr", tag("th", first, scope="row"), *(tag("td", cell) for cell in rest)) for first, *rest in rows]
    parts = [tag("caption", caption)] if caption else []
    return tag("div", tag("table", *parts, head, tag("tbody", *body)), class_="scroll")


def paragraphs(sentences: Iterable[str]) -> Markup:
    """A paragraph for each sentence."""
    return joined(tag("p", sentence) for sentence in sentences)


def warnings(sentences: list[str]) -> Markup | None:
    """Warnings that the reader must see first; None if there are none."""
    if not sentences:
        return None
    word = "Warning" if len(sentences) == 1 else f"{len(sentences)} warnings"
    body = tag("ul", *(tag("li", sentence) for sentence in sentences))
    return tag("aside", tag("strong", word), body, class_="warnings", id="warnings", aria_label="Warnings")


def scene(text: str, command: str = "run", common: bool = False) -> Markup:
    """The complete scene, folded, and the command that reproduces the result; common: to all cases of a sweep."""
    folded = tag(
        "details", tag("summary", "The complete scene, defaults included (TOML)"), tag("pre", text, tabindex="0")
    )
    hint = f"Saved as a file it gives the same again: dolfbuoy {command} FILE."
    hint = "All cases are this scene, but for what varies." if common else hint
    return section("scene", "Scene", tag("p", hint), folded)


def versions(attributes: dict[str, Any]) -> Markup:
    """Versions and date of the record."""
    names = [(key.removeprefix("version_"), value) for key, value in attributes.items() if key.startswith("version_")]
    known = [
        (word, attributes[key]) for word, key in (("computed", "created"), ("ranks", "ranks")) if key in attributes
    ]
    return section("versions", "Versions", table(("program", "version"), [*known[:1], *names, *known[1:]]))
