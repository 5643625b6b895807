"""An effect is declared once: consequences of a declaration, shown with an effect the program does not have.

Source: the energy balance; the terms of the declaration itself.
"""

from typing import Annotated

import numpy as np
import pytest
from alone import simulate
from dynamics_helpers import MOORED, merged
from pydantic import BeforeValidator, create_model
from robustness.random_scenes import ranges

from dolfbuoy import load_scene
from dolfbuoy.model import effects
from dolfbuoy.model.effects import Drawn, Effect
from dolfbuoy.scene import Scene, quantities, reading, sections, segments
from dolfbuoy.scene.cable import Cable
from dolfbuoy.scene.keys import list_keys
from dolfbuoy.scene.lines import Line
from dolfbuoy.studies.physics import effects as left_out
from dolfbuoy.studies.physics import energy

SCENE = merged(MOORED, cable__elements=4, time={"end": 0.4, "step": 0.02})


def ground_drag(C, cable, rho_w, flow, point):
    """A linear drag on the motion over ground."""
    return None if point.velocity is None else -C * point.velocity


@pytest.fixture
def with_ground_drag(monkeypatch):
    """The effect: a key of the scene, a form function, a declaration."""
    drag = sections.key("linear drag over ground", "N s/m^2", default=0.0)
    cable = create_model("Cable", __base__=Cable, ground_drag=(quantities.Coefficient, drag))
    line = create_model(
        "Line", __base__=Line, ground_drag=(quantities.Coefficient | None, sections.key("", default=None))
    )
    monkeypatch.setattr(segments, "Cable", cable)
    monkeypatch.setattr(segments, "PHYSICAL", (*segments.PHYSICAL, "ground_drag"))
    cables = Annotated[list[line], BeforeValidator(sections._as_list)]
    monkeypatch.setattr(reading, "Scene", create_model("Scene", __base__=Scene, cable=(cables | None, None)))
    declared = Effect(
        "ground drag",
        "cable.ground_drag",
        needs=("sea",),
        line=ground_drag,
        account="ground",
        drawn={"cable.ground_drag": Drawn(1e-2, 1e3)},
    )
    monkeypatch.setattr(effects, "EFFECTS", [*effects.EFFECTS, declared])
    return 400.0


def test_a_new_effect_is_seen_everywhere(with_ground_drag):
    scene = load_scene(SCENE, cable__ground_drag=with_ground_drag)
    assert "ground drag" in effects.names(scene)
    assert "ground drag" not in effects.names(load_scene(SCENE))
    plain, dragged = simulate(load_scene(SCENE)), simulate(scene)
    assert "ground drag" in dragged.attrs["effects"]
    assert np.abs(plain.tension_top - dragged.tension_top).max() > 1.0
    assert "ground drag" in left_out.effects_of(scene)
    without = left_out.variant(scene, ["ground drag"])
    np.testing.assert_array_equal(simulate(without).tension_top, plain.tension_top)
    assert ranges()["cable.ground_drag"].example is not None


def test_a_new_effect_is_in_the_energy_balance(with_ground_drag, monkeypatch):
    """Its account takes energy, and the defect goes on vanishing with the order of the scheme."""
    changes = {"cable__ground_drag": with_ground_drag, "buoy__mooring_height": 0.3}
    scene = merged(SCENE, **changes, current=None, time={"end": 1.0})
    monkeypatch.setattr(energy, "load", lambda name, t_end, step, scheme: load_scene(scene, time={"step": step}))
    rows = [
        energy.evaluate({"scene": "", "t_end": 1.0, "step": step, "scheme": "backward-euler"}) for step in (0.01, 0.005)
    ]
    assert all(row["ground"] < 0 for row in rows)
    assert abs(rows[1]["ground"]) > 5 * abs(rows[1]["defect"])
    assert 0.8 < np.log2(rows[0]["defect"] / rows[1]["defect"]) < 1.2


def test_every_declaration_names_keys_of_the_scene():
    """Its own, those that it needs, and those that random scenes draw."""
    keys = [row.name for row in list_keys()]
    known = {*Scene.model_fields, *keys, *(key.rpartition(".")[0] for key in keys)}
    for effect in effects.EFFECTS:
        assert {effect.key, *effect.drawn, *effect.needs} <= known
