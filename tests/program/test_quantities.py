"""An output is declared once: consequences of a declaration, shown with an output the program does not have.

Source: Newton's p = m v, by hand from the recorded momentum.
"""

import matplotlib.image
import numpy as np
import pytest
from dynamics_helpers import MOORED, merged

from dolfbuoy import api, load_scene
from dolfbuoy.commands.statistics import show
from dolfbuoy.commands.sweep import _show
from dolfbuoy.errors import InputError
from dolfbuoy.model.rigid import mass_properties
from dolfbuoy.motion.schemes import BackwardEuler, Scheme
from dolfbuoy.page.result_pages import sweep_data as data_of_sweep
from dolfbuoy.page.run_page import data_of, run_page
from dolfbuoy.results import figures, sweep_figure
from dolfbuoy.results.frame import Frames
from dolfbuoy.results.measured import compute
from dolfbuoy.results.paraview import meshes_of
from dolfbuoy.results.quantities import QUANTITIES, shown_in
from dolfbuoy.results.quantity import EVERYWHERE, Curve, Quantity
from dolfbuoy.results.record import fitting
from dolfbuoy.results.sample import numbers_of
from dolfbuoy.results.statistics import collect, statistics
from dolfbuoy.results.style import COLUMN, FIGURES, figure_of, new_figure
from dolfbuoy.results.summary import summary
from dolfbuoy.scene.sections import SCHEMES

SCENE = load_scene(merged(MOORED, cable__elements=4, time={"end": 0.4, "step": 0.02}))
MASS = mass_properties(SCENE.network.buoys["buoy"]).mass
#: How fast C is.
SPEED = Quantity(
    "buoy_speed",
    ("buoy",),
    "m s-1",
    "speed of C",
    read=lambda noted: np.linalg.norm(noted.motion.momentum, axis=-1) / MASS,
    main=True,
    curves=(Curve("speed", "of C"),),
    summary="speed of C",
    figure=True,
    paraview="speed",
    peaks="",
)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """(record, folder) of a run with the quantity."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(QUANTITIES, SPEED.name, SPEED)
        folder = tmp_path_factory.mktemp("quantities") / "run"
        yield api.simulate(SCENE, folder), folder


def test_it_is_in_the_record(found):
    record, _ = found
    assert record.buoy_speed.dims == ("time", "buoy")
    assert record.buoy_speed.attrs == {"units": "m s-1", "long_name": "speed of C"}
    momentum = record.linear_momentum.values
    np.testing.assert_allclose(record.buoy_speed, np.sqrt((momentum**2).sum(axis=-1)) / MASS, rtol=1e-14)
    assert record.buoy_speed.values.max() > 0


def test_it_is_in_the_summary_and_on_the_page(found):
    record, _ = found
    speed = record.buoy_speed.values[:, 0]
    assert ("speed of C", f"{speed.min():.4g} ... {speed.max():.4g}", "m s-1") in summary(record, SCENE)
    (panel,) = (one for one in data_of(record, SCENE)["panels"] if one["title"] == "speed")
    assert (panel["unit"], panel["kind"], [curve["name"] for curve in panel["curves"]]) == ("m s-1", "buoy", ["of C"])


def test_it_has_a_figure(found):
    record, folder = found
    figures.draw_all(folder)
    assert matplotlib.image.imread(folder / "figures" / "buoy_speed.png").std() > 0
    (axes,) = figures.of_quantity(SPEED)(record, SCENE).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), record.buoy_speed.values[:, 0])
    assert axes.get_ylabel() == "buoy speed [m s-1]"


@pytest.fixture
def hodograph(monkeypatch):
    """A figure that the program does not have: the momentum of C, p_z over p_x."""
    monkeypatch.setitem(FIGURES, "hodograph", None)  # taken out again after the test

    @figure_of("linear_momentum", part="buoy")
    def hodograph(record, scene=None):
        figure = new_figure(COLUMN, 2.0)
        figure.subplots().plot(*record.linear_momentum.values[:, ::2].T)
        return figure

    return hodograph


def test_a_figure_is_one_function(found, hodograph):
    """Registered by its decorator, it is drawn with the others and one of `figures`."""
    record, folder = found
    assert folder / "figures" / "hodograph.png" in figures.draw_all(folder)
    (axes,) = figures.hodograph(record).axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), record.linear_momentum.values[:, 0, 2])


def test_only_a_record_that_lacks_something_is_called_damaged(found):
    """Errors of a program that draws it are not: names that it has not made, wrong kinds, keys of its own tables."""
    record, _ = found
    lacking = (lambda: record.drop_vars("yaw").yaw, lambda: record["nothing"], lambda: record.yaw.values[10**6])
    for fault in (*lacking, lambda: record.buoy_position.sel(xyz="w"), lambda: np.ones(2) + np.ones(3)):
        with pytest.raises(InputError, match=r"run\.nc does not hold what its scene must have"), fitting("run.nc"):
            fault()
    faults = {KeyError: lambda: {}["a"], AttributeError: lambda: SCENE.nothing, TypeError: lambda: len(1)}
    for kind, fault in (faults | {ZeroDivisionError: lambda: 1 / 0}).items():
        with pytest.raises(kind), fitting("run.nc"):
            fault()


def test_it_is_a_field_in_paraview(found):
    record, _ = found
    frames = Frames(record, SCENE)
    fields = meshes_of(frames)["buoy"](frames.at(record.frame.values[-1])).point_data
    np.testing.assert_array_equal(fields["speed [m s-1]"], record.buoy_speed.values[-1])


def test_it_is_in_statistics(found, capsys, tmp_path):
    record, _ = found
    made = statistics(record, start=0.0)
    speed = record.buoy_speed.values[:, 0]
    assert float(made.buoy_speed_maximum) == speed.max()
    assert made.buoy_speed_mean.attrs["units"] == "m s-1"
    show(made, tmp_path)
    assert "buoy speed" in capsys.readouterr().out
    assert "buoy_speed" in shown_in("statistics figure")


def test_it_is_a_column_of_a_sweep(found, capsys, tmp_path):
    record, _ = found
    rows = [{"changes": {"waves.amplitude": a}, "status": "done", "statistics": numbers_of(record)} for a in (0.5, 1.0)]
    made = collect(rows)
    assert made.buoy_speed_maximum.values.tolist() == [[record.buoy_speed.values.max()]] * 2
    assert "buoy_speed" in data_of_sweep(made)["main"]
    assert any("buoy speed" in axes.get_ylabel() for axes in sweep_figure.draw(made).axes)
    _show(made, tmp_path)
    assert "buoy speed max" in capsys.readouterr().out


def test_at_rest_there_is_none_of_what_moves(found):
    assert "buoy_speed" not in api.solve_static(SCENE)


def test_every_declaration_is_complete():
    """A known axis, places that exist, and something that is read of whatever is over time."""
    for name, quantity in QUANTITIES.items():
        assert name == quantity.name
        assert set(quantity.shown) <= set(EVERYWHERE)
        assert quantity.over in ("time", "frame", "run", "sample", "")
        assert quantity.over != "time" or quantity.read or quantity.effort or name == "time"


def test_a_time_scheme_is_a_class_and_a_name(found, monkeypatch):
    """Backward Euler under another name: the same motion, and its name on the page."""
    monkeypatch.setattr(Scheme, "known", {**Scheme.known})
    monkeypatch.setitem(SCHEMES, "twin", "the twin")

    class Twin(BackwardEuler):
        name = "twin"

    assert Scheme.known["twin"] is Twin
    scene = SCENE.model_copy(update={"time": SCENE.time.model_copy(update={"scheme": "twin"})})
    tensions = [run.values["tension_top"] for run in (compute(one, ["tension_top"]) for one in (SCENE, scene))]
    np.testing.assert_array_equal(*tensions)
    assert np.ptp(tensions[0]) > 0
    assert "steps of the twin" in run_page(found[0], scene)
    assert set(Scheme.known) == set(SCHEMES)
