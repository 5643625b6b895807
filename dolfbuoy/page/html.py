"""Words and tables of a page, readable without its script."""

from collections.abc import Iterable
from typing import Any

from . import document
from .document import Markup, joined, tag


def section(name: str, title: str, *children: Any, **attributes: Any) -> Markup:
    """A part of the page with its heading."""
    return tag(
        "section",
        tag("h2", title, id=f"{name}-title"),
        *children,
        id=name,
        aria_labelledby=f"{name}-title",
        **attributes,
    )


def table(headings: Iterable[str], rows: Iterable[Iterable[Any]], caption: str = "") -> Markup:
    """A table whose first column names its rows."""
    head = tag("thead", tag("tr", *(tag("th", text, scope="col") for text in headings)))
    body = [tag("tr", tag("th", first, scope="row"), *(tag("td", cell) for cell in rest)) for first, *rest in rows]
    parts = [tag("caption", caption)] if caption else []
    return tag("div", tag("table", *parts, head, tag("tbody", *body)), class_="scroll")


def paragraphs(sentences: Iterable[str]) -> Markup:
    """One each."""
    return joined(tag("p", sentence) for sentence in sentences)


def warnings(sentences: list[str]) -> Markup | None:
    """Warnings that the reader must see first; None if there is nothing."""
    if not sentences:
        return None
    word = "Warning" if len(sentences) == 1 else f"{len(sentences)} warnings"
    body = tag("ul", *(tag("li", sentence) for sentence in sentences))
    return tag("aside", tag("strong", word), body, class_="warnings", id="warnings", aria_label="Warnings")


def page(title: str, lines: Iterable[str], *children: Markup | None, data: dict[str, Any], script: str) -> str:
    """The file of a page: title, lines below it, the button for the colours, and the parts."""
    button = tag("button", "Colours: auto", id="theme", type="button", class_="quiet")
    top = tag("header", tag("div", tag("h1", title), paragraphs(lines)), button)
    return document.page(title, joined([top, tag("main", *children)]), data, script)


def scene(text: str, command: str = "run", common: bool = False) -> Markup:
    """The complete scene, folded; the command reproduces the result from it; common: to all cases of a sweep."""
    folded = tag(
        "details", tag("summary", "The complete scene, defaults included (TOML)"), tag("pre", text, tabindex="0")
    )
    hint = f"Saved as a file it gives the same again: dolfbuoy {command} FILE."
    hint = "All cases are this scene, but for what varies." if common else hint
    return section("scene", "Scene", tag("p", hint), folded)


def versions(attributes: dict[str, Any]) -> Markup:
    """Versions that computed the record, and when."""
    names = [(key.removeprefix("version_"), value) for key, value in attributes.items() if key.startswith("version_")]
    rows = [("computed", attributes.get("created", "")), *names, ("ranks", attributes.get("ranks", 1))]
    return section("versions", "Versions", table(("program", "version"), rows))
