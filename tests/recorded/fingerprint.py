"""What a command leaves behind as lines of text: words as they stand, arrays by five numbers each."""

import base64
import json
import re
from pathlib import Path
from zipfile import ZipFile

import meshio
import numpy as np
import xarray as xr
from matplotlib.colors import to_hex, to_rgba
from matplotlib.ticker import FixedLocator

#: What differs from run to run, and what stands in its place.
FLEETING = [
    (re.compile(r"\d{4}-\d\d-\d\d(?:[ T]\d\d:\d\d(?::\d\d)?)?"), "DATE"),
    (re.compile(r"\b\d+(?:\.\d+)?(?:e-?\d+)? (?:s|ms) (?:of CPU time|CPU|by the clock)"), "TIME"),
    (re.compile(r"dolfinx \d\S*|PETSc \d\S*|numpy \d\S*|Python \d\S*"), "VERSION"),
    (re.compile(r"^\s*(?:wall time|speed|time) [│|].*$|^t = .*real time.*$", re.M), ""),
    (re.compile(r"^.*(?:wall time|>speed<| x real time|>time<|Security-Policy|to go\.$|\b100% ).*$", re.M), ""),
    (re.compile(r"\btook [\d.]+ s\b"), "took TIME"),
    (re.compile(r"[─━═┏┓┗┛┡┩└┘┳┻╇┴┬├┤┼╞╡╪╭╮╰╯]+"), ""),
]
#: Attributes and variables of a record that a clock or a machine gives.
CLOCKED = re.compile(r"wall|cpu|^seconds|history|date|version|machine|uuid|created")


def of_text(text: str, folder: Path) -> list[str]:
    """Lines of a text without paths, clocks, frames of tables and runs of spaces."""
    text = text.replace(str(folder), "FOLDER")
    for pattern, word in FLEETING:
        text = pattern.sub(word, text)
    lines = (re.sub(r"[ \t]+", " ", re.sub(r"[│┃]", "|", line)).strip() for line in text.splitlines())
    return [line for line in lines if line]


def of_array(values) -> str:
    """Shape; least, largest and mean value and two weighted means, to six digits (of texts: the texts)."""
    values = np.asarray(values)
    if values.dtype.kind not in "fiubc":
        return " ".join(str(x) for x in values.ravel()[:60])
    x = values.astype(float).ravel()
    known = x[np.isfinite(x)]
    shape = "x".join(map(str, values.shape)) or "1"
    if not known.size:
        return f"[{shape}] nothing finite of {x.size}"
    if x.size == 1:
        return f"[1] ~ {known[0]:.5e}"
    k = np.arange(x.size)[np.isfinite(x)]
    weighted = [np.mean(np.cos(rate * (k + 1)) * known) for rate in (2.399963, 0.37)]
    numbers = [known.min(), known.max(), known.mean(), *weighted]
    missing = f" but {x.size - known.size}" if x.size > known.size else ""
    return f"[{shape}]{missing} ~ " + " ".join(f"{number:.5e}" for number in numbers)


def of_record(path: Path) -> list[str]:
    """Variables of a netCDF file with dimensions, attributes and values."""
    with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
        names = [name for name in sorted(data.attrs) if not CLOCKED.search(name)]
        lines = [f"attribute {name} = {_short(data.attrs[name])}" for name in names]
        for name in sorted(map(str, data.variables)):
            if CLOCKED.search(name):
                continue
            variable = data[name]
            kept = {key: variable.attrs[key] for key in sorted(variable.attrs)}
            told = "; ".join(f"{key}: {_short(value)}" for key, value in kept.items())
            lines.append(f"{name}({', '.join(map(str, variable.dims))}) {told} = {of_array(variable.values)}")
    return lines


def _short(value) -> str:
    """A number or text of an attribute on one line."""
    return re.sub(r"\s+", " ", str(value))[:300]


def of_columns(values) -> str:
    """`of_array` of every column alone, whose sizes may have nothing to do with each other."""
    return ", ".join(of_array(column) for column in np.moveaxis(np.asarray(values), -1, 0))


def of_mesh(path: Path) -> list[str]:
    """Points, cells and fields of a mesh for ParaView."""
    mesh = meshio.read(path)
    lines = [f"points {of_columns(mesh.points)}"]
    lines += [f"{block.type} {of_array(block.data)}" for block in mesh.cells]
    lines += [f"{name} at points {of_array(values)}" for name, values in mesh.point_data.items()]
    return lines + [f"{name} of cells {of_array(x)}" for name, values in mesh.cell_data.items() for x in values]


def of_figure(figure, **saved) -> list[str]:
    """Panels with their words, scales, curves, areas, bars and legends; saved: how it is written."""
    lines = [f"figure {figure.get_size_inches()[0]:.2f} x {figure.get_size_inches()[1]:.2f} {saved or ''}"]
    lines += [f"text {t.get_text()!r} {_of_words(t)}" for t in figure.texts if t.get_text()]
    for axes in figure.axes:
        words = [axes.get_title(), axes.get_title("left"), axes.get_xlabel(), axes.get_ylabel()]
        spines = "".join(name[0] for name, spine in axes.spines.items() if axes.axison and spine.get_visible())
        looks = f"{spines} {axes.get_aspect()} {axes.xaxis.label.get_fontsize():.3g} {axes.title.get_fontsize():.3g}"
        lines.append(f"panel {' | '.join(words)} {axes.get_xscale()} {axes.get_yscale()} {looks}")
        lines.append(
            "limits " + ", ".join(f"~ {low:.5e} {high:.5e}" for low, high in (axes.get_xlim(), axes.get_ylim()))
        )
        for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
            if isinstance(axis.get_major_locator(), FixedLocator):
                labels = " | ".join(label.get_text() for label in axis.get_ticklabels())
                lines.append(f"ticks of {name} {labels} {of_array(axis.get_ticklocs())}")
        for line in axes.lines:
            style = f"{_colour(line.get_color(), line.get_alpha())} {line.get_linestyle()} {line.get_linewidth():.3g}"
            marker = f"{line.get_marker()} {line.get_markersize():.3g} {line.get_zorder():.3g}"
            label = line.get_label() if not str(line.get_label()).startswith("_") else ""
            lines.append(f"line {label} {style} {marker} x {of_array(line.get_xdata(orig=False))}")
            lines.append(f"y {of_array(line.get_ydata(orig=False))}")
        for patch in axes.patches:
            style = f"{_colour(patch.get_facecolor())} {_colour(patch.get_edgecolor())} {patch.get_linewidth():.3g}"
            lines.append(f"patch {style} {of_columns(patch.get_path().vertices)}")
            place = patch.get_patch_transform().get_matrix()
            lines += [f"at {of_array(place)}"] if np.any(place != np.eye(3)) else []
        for collection in axes.collections:
            colours = [_colour(c) for c in [*collection.get_facecolor()[:6], *collection.get_edgecolor()[:2]]]
            widths = " ".join(f"{width:.3g}" for width in np.ravel(collection.get_linewidth())[:6])
            lines.append(f"{type(collection).__name__} {' '.join(colours)} {widths} {collection.get_zorder():.3g}")
            paths = [path.vertices for path in collection.get_paths()]
            lines += [f"vertices {of_columns(np.concatenate(paths))}"] if paths else []
            offsets = np.ma.getdata(collection.get_offsets())
            lines += [f"offsets {of_columns(offsets)}"] if np.any(offsets) else []
            values = collection.get_array()
            lines += [f"values {of_array(np.ma.filled(values, np.nan))}"] if values is not None else []
        lines += [f"image {of_array(np.ma.filled(image.get_array(), np.nan))}" for image in axes.images]
        for text in axes.texts:
            x, y = text.xy if hasattr(text, "xy") else text.get_position()
            lines.append(f"text {text.get_text()!r} {_of_words(text)} ~ {x}, ~ {y}")
        lines += _of_legend(axes.get_legend()) if axes.get_legend() else []
    return [*lines, *(line for legend in figure.legends for line in _of_legend(legend))]


def _of_legend(legend) -> list[str]:
    """Words, their size, columns, frame, and what the words stand beside."""
    words = " | ".join(text.get_text() for text in legend.get_texts())
    sizes = sorted({f"{text.get_fontsize():.3g}" for text in legend.get_texts()})
    columns, title = getattr(legend, "_ncols", 1), legend.get_title().get_text()
    keys = [f"{_colour(one.get_color())} {one.get_linestyle()}{one.get_marker()}" for one in legend.get_lines()]
    keys += [_colour(one.get_facecolor()) for one in legend.get_patches()]
    how = f"{columns} columns, {' '.join(sizes)}, {'framed' if legend.get_frame_on() else 'no frame'} {title}"
    return [f"legend {words}", f"legend of {how}".rstrip(), f"keys {' | '.join(keys)}"]


def _colour(colour, alpha=None) -> str:
    """A colour with how much covers what is behind it."""
    return to_hex(to_rgba(colour, alpha), keep_alpha=True)


def _of_words(text) -> str:
    """Looks of a text."""
    size, sides = f"{text.get_fontsize():.3g}", f"{text.get_ha()} {text.get_va()}"
    return f"{size} {_colour(text.get_color())} {sides} {text.get_rotation():.3g}"


def of_page(path: Path, folder: Path) -> list[str]:
    """Words of an HTML file, and the data that its scripts draw; scripts and styles themselves are not data."""
    html = path.read_text()
    data = re.search(r'<script id="data"[^>]*>(.*?)</script>', html, re.S)
    words = re.sub(r"<(script|style)[^>]*>.*?</\1>", "\n", html, flags=re.S)
    words = re.sub(r'"data:[^"]*"', '"DATA"', words)
    lines = of_text(re.sub(r"(</?(?:p|tr|h\d|li|table|section|figure|div|path|g|text)\b)", r"\n\1", words), folder)
    return lines + (list(_of_json(json.loads(data[1]), "data")) if data else [])


def _of_json(value, name):
    """A line for every leaf of the data of a page."""
    if isinstance(value, dict) and {"type", "data"} <= set(value) and isinstance(value["data"], str):
        array = np.frombuffer(base64.b64decode(value["data"]), dtype="<" + value["type"])
        yield f"{name} {value.get('shape', '')} {of_array(array)}"
    elif isinstance(value, dict):
        for key in value:
            if not CLOCKED.search(key):
                yield from _of_json(value[key], f"{name}.{key}")
    elif isinstance(value, list) and value and all(type(x) in (int, float) for x in value):
        yield f"{name} {of_array(value)}"
    elif isinstance(value, list):
        for k, x in enumerate(value):
            yield from _of_json(x, f"{name}[{k}]")
    elif isinstance(value, float):
        yield f"{name} {of_array(value)}"
    else:
        yield f"{name} {_short(value)}"


def of_model(path: Path, folder: Path) -> list[str]:
    """Files of an FMU, and what it says of itself but for its token and the version."""
    with ZipFile(path) as file:
        names, described = sorted(file.namelist()), file.read("modelDescription.xml").decode()
    described = re.sub(r"\{[-0-9a-f]{36}\}|dolfbuoy \d[\w.]*", "", described)
    described = re.sub(r"\d\.\d{9,}(?:e-?\d+)?", lambda number: f"{float(number[0]):.6g}", described)
    return [re.sub("binaries/[^/]*", "binaries", name) for name in names] + of_text(described, folder)


def of_file(path: Path, folder: Path) -> list[str]:
    """Lines of a file by its kind; nothing of pictures, which are known by their figures, and of checkpoints."""
    if path.name in ("schema.json", ".dolfbuoy.json"):  # the one is in the package, the other names times
        return []
    if path.suffix == ".nc":
        return of_record(path)
    if path.suffix == ".vtu":
        return of_mesh(path)
    if path.suffix == ".html":
        return of_page(path, folder)
    if path.suffix == ".fmu":
        return of_model(path, folder)
    if path.suffix in (".toml", ".txt", ".csv", ".dat", ".md", ".json", ".xml", ".xdmf", ".pvd"):
        return of_text(path.read_text(), folder)
    return []


#: A number below is what rounding leaves.
NOISE = 1e-9
#: A number in a text.
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\d)", re.I)


def difference(recorded: str, found: str, exact: bool = True) -> str | None:
    """What two lines differ in; None if in no more than rounding.

    A number of several behind a "~" may differ by 2e-5 of the largest of them, up to the next "~"; one in a text by a
    unit of its last digit, that of the finer one.  Integers and numbers of one digit, such as limits, differ by
    nothing, unless not `exact`; noise by itself.
    """
    if recorded == found:
        return None
    if NUMBER.sub("#", recorded) != NUMBER.sub("#", found):
        return "other words"
    words, *arrays = [NUMBER.findall(part) for part in recorded.split("~")]
    allowed = [_allowed(a, b, exact) for a, b in zip(words, NUMBER.findall(found), strict=False)]
    for array in arrays:
        allowed += [2e-5 * max(abs(float(x)) for x in array) + 1e-12 for _ in array]
    for a, b, most in zip(NUMBER.findall(recorded), NUMBER.findall(found), allowed, strict=True):
        if abs(float(a) - float(b)) > 1.001 * most:
            return f"{a} was recorded, {b} is found"
    return None


def _allowed(recorded: str, found: str, exact: bool) -> float:
    """Difference between two numbers of a text that is rounding."""
    units, size = [_unit(text) for text in (recorded, found)], max(abs(float(recorded)), abs(float(found)))
    if not exact:
        return max(unit or 1.0 for unit in units)
    if all(len(re.sub(r"e.*|[-+.]", "", text.lower()).lstrip("0")) < 2 for text in (recorded, found)):
        return size if size < NOISE else 0.0
    return min(filter(None, units), default=0.0)


def _unit(text: str) -> float:
    """Unit of the last digit of a number; 0 for an integer."""
    digits, _, exponent = text.lower().partition("e")
    if "." not in digits and not exponent:
        return 0.0
    return 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
