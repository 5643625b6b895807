"""What scenes may name and what becomes of it: floats, options of PETSc, files beside them; criteria, judged."""

from functools import partial
from pathlib import Path

import tomli_w
from made_up import RECORD, SCENE
from told import MOORED, refused

from dolfbuoy import load_scene
from dolfbuoy.results.criteria import governing, never_met, verdicts
from dolfbuoy.scene.fatigue import CURVES, curve_of
from dolfbuoy.scene.floats import FLOATS, float_of, keys_of
from dolfbuoy.scene.petsc_options import ALLOWED, checked

LINE = {"length": 20.0, "line_density": 5.0, "axial_stiffness": 1e5, "elements": 4, "diameter": 0.05}
HELD = LINE | {"top": {"kind": "fixed", "position": [5.0, 0.0, -5.0]}}
WATER = {"sea": {"depth": 20.0}, "time": {"end": 1.0, "step": 0.1}}
STEEP = {"theory": "stream", "height": 1.2, "wavelength": 30.0, "order": 9}


def of_floats():
    """Floats of the library, in a joint and in a chain of segments; what a variation of them keeps."""
    for name, one in FLOATS.items():
        print(name, *(f"{key} {value:.7g}" for key, value in keys_of(one).items()))
    segment = {"length": 10.0, "elements": 2, "body": {"float": "Viny 16 in", "drag_area": 0.3}}
    cable = LINE | {"top": {"kind": "free", "force": [0.0, 0.0, 900.0]}, "length": None, "elements": None}
    chain = cable | {"segments": [segment, {"length": 10.0, "elements": 2}]}
    held = load_scene(WATER | {"cable": chain})
    body = held.cables[0].segments[0].body
    print(body, float_of(body), float_of(body.model_copy(update={"mass": 1.0})))
    joint = {"name": "j", "float": "glass 17 in"}
    pair = [LINE | {"name": "a", "from": [0, 0, -20], "to": "j"}]
    scene = load_scene(WATER | {"cable": pair, "joint": [joint]})
    print(scene.joint, load_scene(scene, **{"joint.j.float": "ORE 28 in", "joint.j.added_mass": 0.7}).joint)
    refused(
        lambda: load_scene(WATER | {"cable": pair, "joint": [joint | {"float": "balloon"}]}),
        lambda: load_scene(WATER | {"cable": cable | {"segments": [segment | {"body": {"float": 3}}, segment]}}),
    )


def of_options():
    """Every option of PETSc at its bounds, beyond them and of another kind; those that need others."""
    for name, allowed in ALLOWED.items():
        print(name, allowed)
    wanted = [
        {"snes_max_it": 0},
        {"snes_max_it": 2.0},
        {"snes_monitor": 1},
        {"ksp_rtol": float("nan")},
        {"ksp_rtol": 2.0},
        {"ksp_type": "cg"},
        {"pc_type": "python"},
        {"snes_view": "a"},
        {"ksp_gmres_restart": 30, "ksp_type": "bcgs"},
        {"pc_factor_levels": 2},
        {"pc_factor_levels": 2, "pc_type": "jacobi"},
        {"pc_factor_shift_type": "nonzero", "pc_type": "asm"},
        {"pc_factor_mat_solver_type": "mumps", "pc_type": "ilu"},
        {"pc_asm_overlap": 2, "pc_type": "bjacobi"},
        {"pc_bjacobi_blocks": 2},
        {"sub_pc_type": "lu"},
        {"sub_pc_factor_levels": 2, "sub_pc_type": "lu", "pc_type": "asm"},
        {"sub_pc_factor_mat_solver_type": "petsc", "pc_type": "asm"},
        {"sub_pc_factor_shift_amount": 1e-9, "sub_pc_type": "none", "pc_type": "asm"},
        {"mat_mumps_icntl_14": 50, "pc_factor_mat_solver_type": "superlu"},
    ]

    def named(options):
        try:
            return checked(options)
        except ValueError as error:
            return error

    for options in wanted:
        print(named(options))
    print(checked({"snes_monitor": False, "ksp_monitor": True, "ksp_type": "fgmres", "ksp_gmres_restart": 30}))
    refused(lambda: load_scene(MOORED | {"solver": {"petsc": {"snes_max_it": 0}}}))


def beside(scene):
    """A scene as a file beside those that it names."""
    Path("scene.toml").write_text(tomli_w.dumps(scene))
    return load_scene(Path("scene.toml"))


def of_files():
    """Elements by a mesh, materials of a library of one's own; files that do not serve."""
    nodes = [0.0, 3.0, 7.0, 12.0, 20.0]
    edges = "\n".join(f"{k + 1} 1 2 1 1 {k + 1} {k + 2}" for k in range(4))
    points = "\n".join(f"{k + 1} {x} 0 0" for k, x in enumerate(nodes))
    text = (
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n{points}\n$EndNodes\n$Elements\n4\n{edges}\n$EndElements\n"
    )
    Path("line.msh").write_text(text)
    print(beside(WATER | {"cable": HELD | {"elements": "line.msh"}}).cables[0].elements)
    own = {"My rope": {"line_density": 3.0, "axial_stiffness": 4e5, "diameter": 0.04, "source": "a data sheet"}}
    Path("own.toml").write_text(tomli_w.dumps(own))
    bare = {key: HELD[key] for key in ("length", "elements", "top")}
    scene = beside(WATER | {"library": "own.toml", "cable": bare | {"material": "My rope"}})
    print(scene.material, scene.cables[0].line_density, scene.cables[0].material)
    Path("wrong.toml").write_text("a = 1\n")
    Path("large.toml").write_text("# " + "x" * 1_000_000)
    Path("open.xdmf").write_text('<?xml version="1.0"?><Xdmf><DataItem Format="Binary">a</DataItem></Xdmf>')
    Path("included.xdmf").write_text('<Xdmf xmlns:x="x"><x:include href="other"/></Xdmf>')
    Path("declared.xdmf").write_text('<!DOCTYPE Xdmf SYSTEM "a"><Xdmf/>')
    Path("heavy.xdmf").write_text('<Xdmf><DataItem Format="HDF">none.h5:/a</DataItem></Xdmf>')
    Path("torn.xdmf").write_text("<Xdmf>")
    libraries = ("wrong.toml", "large.toml", "none.toml", "../own.toml", "/own.toml", "a" * 300, "a\0b")
    refused(
        *(partial(beside, WATER | {"library": name, "cable": HELD}) for name in libraries[:-1]),
        lambda: load_scene(WATER | {"library": 3, "cable": HELD}),
        lambda: load_scene(
            WATER
            | {"material": {"My-rope": {"line_density": 1.0}}, "library": Path("own.toml")}
            | {"cable": bare | {"material": "My rope"}}
        ),
        *(
            partial(beside, WATER | {"cable": HELD | {"elements": f"{name}.xdmf"}})
            for name in ("open", "included", "declared", "heavy", "torn", "none")
        ),
        *(partial(beside, WATER | {"cable": HELD | {"elements": name}}) for name in ("own.toml", "../line.msh")),
    )
    Path("large.toml").unlink()


def of_waves():
    """A steep wave by its length: the period that follows, in currents and without gravity's own value."""
    for more in ({}, {"gravity": 3.7}, {"current": {"speed": 1.0}}):
        scene = load_scene({"sea": {"depth": 20.0}, "cable": HELD, "waves": STEEP, "time": WATER["time"]} | more)
        print(
            f"{scene.waves.period:.9g}", scene.waves.wavelength, f"{scene.waves.main_period:.9g} {scene.waves.size:.9g}"
        )
    for waves in (
        {"components": [[0.2, 3.0, 0, 0], [0.5, 6.0, 0, 0]]},
        {"elevation": [[float(t), (-1.0) ** (t // 2)] for t in range(12)]},
    ):
        print(f"{load_scene(WATER | {'cable': HELD, 'waves': waves}).waves.main_period:.9g}")
    refused(
        lambda: load_scene(WATER | {"cable": HELD, "waves": STEEP | {"period": 4.0}}),
        lambda: load_scene(WATER | {"cable": HELD, "waves": STEEP | {"period_seen_from": "ground"}}),
        lambda: load_scene(WATER | {"cable": HELD, "waves": STEEP | {"stretching": "linear"}}),
    )


def of_criteria():
    """Verdicts by every code and condition, of the made-up record and of a rest; with what its bars leave open."""
    rows = {
        "output": ["utilisation.max", "offset.max"],
        "output_of": ["cable", "buoy"],
        "bar_verdict": ["both", "none"],
    }
    use = RECORD.tension_top / 12e3
    more = {name: ("output", values) for name, values in rows.items()} | {"bar": ("output", [0.03, 0.5])}
    record = RECORD.assign(utilisation=use.assign_attrs(units="1")).assign(more)
    common = {"largest_offset": 6.0, "largest_lean_deg": 15.0, "least_freeboard": 0.8, "no_uplift": True}
    common |= {"largest_anchor_force": 950.0, "limits": ["tension_top.mean < 7000", "offset.min > 1.5"]}
    for how in (
        common | {"safety_factor": 1.9},
        *({"safety": "API", "condition": condition} for condition in ("intact", "one line broken")),
        *({"safety": "DNV", "condition": "intact", "consequence_class": k} for k in (1, 2)),
        *({"safety": "DNV", "condition": "one line broken", "consequence_class": k} for k in (1, 2)),
    ):
        scene = load_scene(SCENE, cable__breaking_load=12e3, criteria=how)
        found = verdicts(record, scene)
        for one in found:
            numbers = " ".join(f"{x:.6g}" for x in (one.value, one.limit, one.bar, one.margin, one.use))
            print(one.criterion, one.part, numbers, one.unit, one.upper)
        print(*(one.criterion for one in governing(found)), *never_met(found), sep="\n")
    for start in (0.0, 30.0):
        print(*(f"{one.criterion} {one.value:.7g}" for one in verdicts(record, scene, start)))
    refused(
        lambda: verdicts(record, load_scene(SCENE, criteria={"limits": ["cone_angles.max < 3"]})),
        lambda: verdicts(record, load_scene(SCENE, criteria={"limits": ["offset.max[two] < 3"]})),
        *(
            partial(load_scene, SCENE, criteria=criteria)
            for criteria in ({}, {"safety": "DNV"}, {"condition": "one line broken"})
        ),
        *(partial(load_scene, SCENE, criteria={"limits": [text]}) for text in ("offset < 3", "offset.max < x")),
    )


def of_fatigue():
    """Constants of curves, and the tension that ranges refer to, of worn bars and of bars that are not weaker."""
    for curve in (*CURVES.values(), curve_of("6e10 MPa^3"), curve_of("1e4 kN^2.5"), curve_of("316 MBL^3")):
        known = [curve.reference(2e6, 4e-3, corrosion) for corrosion in (0.0, 0.004)]
        print(curve, curve.of_grade_orq, curve.needs, *(f"{x:.7g}" for x in (*known, curve.reference(9e6, 4e-3))))
        try:
            print(curve.reference())
        except ValueError as error:
            print(error)
    for text in ("none", "0 N^3", "1 N^0.5", "1 N^51", "x N^3"):
        try:
            curve_of(text)
        except ValueError as error:
            print(error)


of_floats()
of_options()
of_files()
of_waves()
of_criteria()
of_fatigue()
