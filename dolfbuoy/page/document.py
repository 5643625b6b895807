"""One HTML file that needs nothing else: style, text, data, script, and a policy that lets in only these.

Whatever comes from a scene enters as escaped text or inside the JSON block, where `<` cannot end it.
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
    """An element; children that are not Markup are escaped, attributes too.  class_ is class, a_b is a-b."""
    given = "".join(f' {key.strip("_").replace("_", "-")}="{html.escape(str(v))}"' for key, v in attributes.items())
    return Markup(f"<{name}{given}>{joined(children)}</{name}>")


def joined(children: Iterable[Any]) -> Markup:
    """Children one after another."""
    return Markup("".join(c if isinstance(c, Markup) else html.escape(str(c)) for c in children if c is not None))


def page(title: str, body: Markup, data: dict[str, Any], script: str) -> str:
    """The file; script: name of a module in this folder, which comes with those that it imports."""
    style, script = style_sheet(), _with_imports(script)
    policy = (
        f"default-src 'none'; style-src {_hash(style)}; script-src {_hash(script)}; base-uri 'none'; form-action 'none'"
    )
    parts = {"policy": policy, "title": html.escape(title), "style": style, "body": body, "data": as_json(data)}
    parts["script"] = script
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _read("page.html"))


def style_sheet() -> str:
    """Style of all pages; the dark colours are those of the system's choice and of the button's."""
    return _read("page.css").replace("{{dark}}", _read("dark.css"))


def as_json(data: dict[str, Any]) -> str:
    """JSON that may stand inside an HTML element; what is not finite becomes null."""
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
    """One module of several that import each other's names: each once, after those that it needs, without imports."""
    found = {}

    def add(name: str) -> None:
        code = _read(f"{name}.js")
        for other in re.findall(r'^import [^;]* from "\./(\w+)\.js";$', code, re.MULTILINE):
            if other not in found:
                add(other)
        found[name] = re.sub(r"^import [^;]*;\n|^export (?=class|function|const)", "", code, flags=re.MULTILINE)

    add(name)
    return "\n".join(found.values())


def _hash(text: str) -> str:
    """As a policy names an inline block."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def fragment(name: str, **parts: str) -> Markup:
    """A piece of a page from its file, with texts in the places that it names."""
    return Markup(re.sub(r"\{\{(\w+)\}\}", lambda found: html.escape(parts[found[1]]), _read(f"{name}.html")))
