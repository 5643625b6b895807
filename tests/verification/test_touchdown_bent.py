"""Line direction at the touchdown: higher degrees pay with bending stiffness, and less without.

Source: orders of approximation (mu of r' where it is smooth, at most 2 where the curvature jumps within an element);
the closed form of the frictionless chain at rest.
"""

import pytest
from helpers import reference
from verification import touchdown_bent as study

from dolfbuoy.errors import InputError
from dolfbuoy.studies.study import run

H = reference("bed_and_networks")["cases"]["bed_chain100_frictionless"]["values"]["T_anchor"]


@pytest.mark.slow
def test_degree_pays_at_a_touchdown_with_bending(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "ELEMENTS", (20, 40, 80))
    scene = study.request("chain-on-bed")
    tables = run(study.study, tmp_path, **scene).rows
    found = {name: study.groups(tables[f"touchdown-{name}"], "pair") for name in ("cable", "bent")}
    order = {name: [study.mean_order(curve, "direction") for curve in found[name].values()] for name in found}
    assert order["bent"][:3] == pytest.approx([1.0, 2.0, 2.4], abs=0.3)
    assert order["bent"][3] > 3.0
    assert order["cable"][0] == pytest.approx(1.0, abs=0.1)
    assert max(order["cable"]) < 2.3
    best = {name: curve["P4-P3"][-1]["direction"] for name, curve in found.items()}
    plain = {name: curve["P2-P1"][-1]["direction"] for name, curve in found.items()}
    assert plain["bent"] / best["bent"] > 10 * plain["cable"] / best["cable"] > 10
    assert study.evaluate({"scene": scene["scene"].to_dict()})["H"] == pytest.approx(H, rel=2e-3)


@pytest.mark.parametrize("scene", ["short-bed", "driven"])
def test_other_scenes_have_no_such_touchdown(scene):
    with pytest.raises(InputError, match="seabed: must be given"):
        study.request(scene)
