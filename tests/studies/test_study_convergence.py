"""The study of Figs. 2 to 4: numbers of a separate code, orders, conclusions, ranks, resumption.

Source: errors of a separate numpy code (tests/reference), finite element theory.
"""

import json
import math

import numpy as np
import pytest
from helpers import reference
from mpi_helpers import needs_mpirun, start

from dolfbuoy.errors import InputError
from dolfbuoy.parallel import cases
from dolfbuoy.studies.accuracy import convergence as study
from dolfbuoy.studies.accuracy.convergence import lagrange
from dolfbuoy.studies.study import run

NAMES = {"r_L2": ("L2r", 1e-13), "r_H1": ("H1r", 1e-12), "T_L2": ("L2T", 1e-12)}  # and the rounding of both codes


def case(mu, nu, cells, material="inextensible", strain="exact", end="Neumann"):
    return {"material": material, "strain": strain, "end": end, "mu": mu, "nu": nu, "cells": cells}


@pytest.mark.parametrize(
    ("table", "material", "strain", "pairs"),
    [
        ("inextensible", "inextensible", "exact", study.OPTIMAL),
        ("elastic_element_average", "elastic", "element-average", study.OPTIMAL),
        ("elastic", "elastic", "exact", study.OPTIMAL),
        ("inextensible_mu4", "inextensible", "exact", [(4, nu) for nu in range(4)]),
    ],
    ids=["fig2", "fig3", "fig3-exact", "fig4"],
)
def test_errors_equal_those_of_another_code(table, material, strain, pairs):
    for mu, nu in pairs:
        for row in reference("convergence")[table][f"P{mu}P{nu}"][::2]:
            found = study.evaluate(case(mu, nu, row["N"], material, strain))
            for name, (key, rounding) in NAMES.items():
                assert math.isclose(found[name], row[key], rel_tol=1e-6, abs_tol=rounding), (mu, nu, row["N"], name)


@pytest.mark.parametrize("figure", [2, pytest.param(3, marks=pytest.mark.slow), 4])
def test_orders_agree_with_theory(figure, tmp_path, monkeypatch):
    """Between 8, 16 and 32 elements; Neumann and Dirichlet ends."""
    monkeypatch.setattr(study, "draw", lambda *_: None)
    tables = run(study.study, tmp_path, figures=(figure,), cells=(8, 16, 32)).rows
    assert list(tables) == [f"figure{figure}-neumann", f"figure{figure}-dirichlet"]
    for rows in tables.values():
        assert len(rows) == len(study.FIGURES[figure][1]) * 4 * 3
        for row in rows:
            for name in study.ERRORS:
                order, expected = row[f"order_{name}"], row[f"theory_{name}"]
                if row["cells"] == 8:
                    assert order is None
                else:
                    assert math.isclose(order, expected, abs_tol=0.15), (row, name)
        said = study.in_words(rows)
        assert "agree with" in said[0]
        assert (said[1:] == []) if figure == 2 else ("stalls" if figure == 3 else "whatever mu") in said[1]


def test_averaged_strain_limits_the_position_and_between_fixed_ends_the_tension():
    """A free end's force alone decides T; between fixed ends T is as wrong as the length: order 2."""
    for end, power in (("Neumann", 4), ("Dirichlet", 2)):
        coarse, fine = (study.evaluate(case(4, 3, n, "elastic", "element-average", end)) for n in (8, 16))
        assert math.isclose(math.log2(coarse["r_L2"] / fine["r_L2"]), 2, abs_tol=0.05)
        assert math.isclose(math.log2(coarse["r_H1"] / fine["r_H1"]), 1, abs_tol=0.05)
        assert math.isclose(math.log2(coarse["T_L2"] / fine["T_L2"]), power, abs_tol=0.05)


def test_profile_is_exact_for_polynomials():
    """Interpolation on the elements' own nodes reproduces r, r' and T of their degree."""
    nodes = np.array([-1.0, -0.4, 0.5, 1.0])
    x = np.linspace(-1, 1, 7)
    value, slope = lagrange(nodes, x)
    np.testing.assert_allclose(value @ nodes**3, x**3, atol=1e-14)
    np.testing.assert_allclose(slope @ nodes**3, 3 * x**2, atol=1e-13)


def test_errors_at_rounding_are_marked_and_have_no_order():
    sizes, error = (16, 32, 64), (3.2e-12, 1e-13, 1.2e-13)
    rows = [case(4, 3, n) | {"h": 1 / n} | dict.fromkeys(study.ERRORS, e) for n, e in zip(sizes, error, strict=True)]
    rows = study.add_orders([row | {"smallest_tension": 0.5} for row in rows])
    assert [row["rounding_r_L2"] for row in rows] == [False, True, True]
    assert [row["order_r_L2"] for row in rows] == [None, None, None]
    assert any("rounding" in note for note in study.in_words(rows))
    assert study.texts(rows[1])["shown_order_r_L2"] == "rounding (5)"
    study.draw(2, rows + [row | {"mu": mu} for mu in (1, 2, 3) for row in rows])


def test_compressed_states_are_named():
    row = study.add_orders([case(2, 1, 4) | study.evaluate(case(2, 1, 4)) | {"smallest_tension": -0.1}])
    assert "Compressed states (T <= 0 somewhere): P2-P1 on 4 elements." in study.in_words(row)


def test_each_case_is_computed_once_and_a_second_call_computes_nothing(tmp_path, monkeypatch, capsys):
    wanted = study.cases((2, 4), (2, 4))
    assert len(wanted) == 2 * 2 * (4 + 3)  # P4-P3 is in both figures
    first = run(study.study, tmp_path, figures=(2,), cells=(2, 4)).rows
    files = {f.name: f.read_bytes() for f in tmp_path.glob("*.[cj]s*")}
    made = {f"figure2-{end}.{suffix}" for end in ("neumann", "dirichlet") for suffix in ("csv", "json")}
    assert set(files) == made | {".dolfbuoy.json"}
    assert (tmp_path / "figure2-neumann.png").stat().st_size > 10_000
    assert (tmp_path / "figure2-neumann.svg").is_file()
    kept = json.loads(files["figure2-neumann.json"])["rows"]
    assert kept[3]["order_T_L2"] == first["figure2-neumann"][3]["order_T_L2"]
    monkeypatch.setattr(study, "evaluate", None)
    monkeypatch.setattr(study, "draw", lambda *_: None)
    assert run(study.study, tmp_path, figures=(2,), cells=(2, 4)).rows == first
    assert {f.name: f.read_bytes() for f in tmp_path.glob("*.[cj]s*")} == files
    assert "P4-P3" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.mpi
@needs_mpirun
def test_two_ranks_write_the_same_files(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "draw", lambda *_: None)
    program = "from dolfbuoy.studies.accuracy import convergence as s; from dolfbuoy.studies.study import run; "
    program += "s.draw = lambda *_: None; run(s.study, 'two', figures=(4,), cells=(2, 4))"
    done = start(2, ["-c", program], tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    run(study.study, tmp_path / "one", figures=(4,), cells=(2, 4))
    for end in ("neumann", "dirichlet"):
        for suffix in ("json", "csv"):
            one, two = ((tmp_path / folder / f"figure4-{end}.{suffix}").read_text() for folder in ("one", "two"))
            assert one == two
            assert len(one) > 1000


@pytest.mark.parametrize("text", ["2,x", "", "4,2", "0,2", "2,2", "-1", "1.5"])
def test_wrong_cells_are_refused(text):
    with pytest.raises(InputError, match="must be positive whole numbers, increasing"):
        study.parse_cells(text)


def test_options():
    assert study.parse_cells("2,4,8") == (2, 4, 8)
    assert study.parse_figures("all") == (2, 3, 4)
    assert study.parse_figures("3") == (3,)
    with pytest.raises(InputError, match="2, 3, 4 or all"):
        study.parse_figures("5")
    assert cases.key(case(1, 0, 2)) != cases.key(case(1, 0, 4))
