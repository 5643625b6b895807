"""A scene as an FMU: under FMI 3.0, FMPy gets the results of a Session; order of input extrapolation.

Source: the FMI 3.0 schema and FMPy's validation; the same scene in Python; orders 1, 2 and 3 for inputs held constant,
or extrapolated linearly or quadratically.
"""

import zipfile
from types import SimpleNamespace
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from dynamics_helpers import MOORED, merged
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from own_body import example, furthest

from dolfbuoy import InputError, Session, load_scene
from dolfbuoy.coupling.fmu import export
from dolfbuoy.coupling.paths import BodyState, Wrench

TOP = {"kind": "fixed", "position": [12.0, 0.5, -3.5]}
LINE = {
    "sea": MOORED["sea"],
    "cable": merged(
        MOORED["cable"], elements=6, axial_stiffness=1e6, top={"kind": "fixed", "position": [12, 0.5, -3.5]}
    ),
    "time": {"end": 1.0, "step": 0.01, "scheme": "bdf2"},
}
LONE = merged(MOORED, cable__elements=6, waves__ramp=0.2, time={"end": 1.0, "step": 0.02})


class Slave(FMU3Slave):
    """An initialised FMU; variables by name."""

    def __init__(self, file, folder, start=0.0, ready=True):
        self.model = fmpy.read_model_description(file)
        self.places = {one.name: one.valueReference for one in self.model.modelVariables}
        kinds = {"guid": self.model.guid, "unzipDirectory": fmpy.extract(file, folder)}
        super().__init__(instanceName="one", modelIdentifier=self.model.coSimulation.modelIdentifier, **kinds)
        self.instantiate()
        if ready:
            self.enterInitializationMode(startTime=start)
            self.exitInitializationMode()

    def read(self, *names):
        return np.array(self.getFloat64([self.places[name] for name in names]))

    def write(self, **values):
        names = [name.replace("__", ".") for name in values]
        self.setFloat64([self.places[name] for name in names], list(values.values()))


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    file = tmp_path_factory.mktemp("fmu") / "line.fmu"
    export(load_scene(LINE), file, ["cable.to"])
    return file


def test_the_file_is_valid(line, tmp_path, call):
    assert validate_fmu(str(line)) == []
    assert "6 inputs, 19 outputs" in call("fmu", "three-legs", "--out", tmp_path / "legs.fmu")[1]
    assert validate_fmu(str(tmp_path / "legs.fmu")) == []
    with zipfile.ZipFile(line) as file:
        (model,) = ElementTree.fromstring(file.read("modelDescription.xml")).iter("CoSimulation")
    assert model.get("canGetAndSetFMUState") == model.get("canSerializeFMUState") == "true"


def test_inputs_at_the_end_of_a_step_are_those_of_a_session(line, tmp_path):
    slave = Slave(line, tmp_path / "fmu", start=3.0)
    slave.setInt32([slave.places["extrapolation"]], [0])
    names = ("time", "cable.to.fx", "cable.to.fy", "cable.to.fz", "cable.tension_top", "cable.tension_anchor")
    with Session(LINE, driven="cable.to") as s:
        for k in range(21):
            values = s.values()
            expected = [s.t, *s.pull("cable.to"), values["tension_top"][0], values["tension_anchor"][0]]
            np.testing.assert_allclose(slave.read(*names), [3.0 + expected[0], *expected[1:]], rtol=1e-15, atol=0)
            z = -3.5 + 0.002 * (k + 1) ** 2 / 8
            s.drive("cable.to", [12.0, 0.5, z])
            s.step(0.02)
            slave.write(cable__to__z=z)
            slave.doStep(3.0 + k * 0.02, 0.02)
    slave.terminate()
    slave.freeInstance()


def test_a_load_on_a_free_buoy_is_that_of_a_session(tmp_path):
    file = tmp_path / "lone.fmu"
    export(load_scene(LONE), file)
    slave = Slave(file, tmp_path / "fmu")
    names = [f"buoy.{x}" for x in ("x", "y", "z", "q0", "q1", "q2", "q3", "vx", "vy", "vz", "wx", "wy", "wz")]
    with Session(LONE) as s:
        for k in range(10):
            np.testing.assert_array_equal(slave.read(*names), np.concatenate(s.state("buoy")))
            s.load("buoy", [100.0 * k, 0.0, 0.0], [0.0, 20.0, 0.0])
            s.step(0.02)
            slave.write(buoy__load_fx=100.0 * k, buoy__load_my=20.0)
            slave.doStep(k * 0.02, 0.02)
    slave.freeInstance()


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_order_in_the_communication_step_is_that_of_the_extrapolation(tmp_path, degree):
    def place(t):
        return -3.5 + 0.3 * np.sin(2 * t) ** 3

    scene, exact = merged(LINE, time__step=0.0025), []
    export(load_scene(scene), tmp_path / "line.fmu", ["cable.to"])
    with Session(scene, driven="cable.to") as s:
        s.drive("cable.to", lambda t: [12.0, 0.5, place(t)])
        for _ in range(20):
            s.step(0.04)
            exact.append(s.pull("cable.to")[2])
    slave, errors = Slave(tmp_path / "line.fmu", tmp_path / "fmu"), []
    for steps in (2, 4):  # in 0.04 s
        slave.reset()
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slave.setInt32([slave.places["extrapolation"]], [degree])
        found = []
        for k in range(20 * steps):
            slave.write(cable__to__z=place(k * 0.04 / steps))
            slave.doStep(k * 0.04 / steps, 0.04 / steps)
            found.append(slave.read("cable.to.fz")[0])
        errors.append(np.abs(np.array(found)[steps - 1 :: steps] - exact).max())
    slave.freeInstance()
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.15)


def test_states_are_taken_back_bit_for_bit(line, tmp_path):
    slave = Slave(line, tmp_path / "fmu")

    def go(begin, end):
        found = []
        for k in range(begin, end):
            slave.write(cable__to__z=-3.5 + 0.01 * np.sin(k))
            slave.doStep(k * 0.02, 0.02)
            found.append(slave.read("cable.to.fx", "cable.to.fz", "cable.tension_anchor"))
        return np.array(found)

    go(0, 3)
    here = slave.getFMUState()
    straight = go(3, 8)
    for _ in range(2):
        slave.setFMUState(here)
        np.testing.assert_array_equal(go(3, 8), straight)
    slave.freeFMUState(here)
    slave.freeInstance()


def test_states_go_on_in_another_instance(line, tmp_path):
    """As bytes, in an instance that is or is not yet initialised; other bytes are refused."""

    def go(slave, begin, end):
        found = []
        for k in range(begin, end):
            slave.write(cable__to__z=-3.5 + 0.01 * np.sin(k))
            slave.doStep(k * 0.02, 0.02)
            found.append(slave.read("time", "cable.to.fx", "cable.to.fz", "cable.tension_anchor"))
        return np.array(found)

    slave = Slave(line, tmp_path / "fmu")
    go(slave, 0, 3)
    content = slave.serializeFMUState(slave.getFMUState())
    straight = go(slave, 3, 8)
    slave.freeInstance()
    for ready in (True, False):
        other = Slave(line, tmp_path / "fmu", ready=ready)
        other.setFMUState(other.deserializeFMUState(content))
        np.testing.assert_array_equal(go(other, 3, 8), straight)
        for wrong in (b"", content[:40], content[:-5], content[:-400] + 400 * b"x", bytes(len(content))):
            with pytest.raises(Exception, match="fmi3DeserializeFMUState"):
                other.deserializeFMUState(wrong)
        other.freeInstance()


def test_a_body_of_ones_own_coupled_by_fmi(tmp_path):
    """The README's example steps an FMU in place of a Session: strong coupling by FMU states."""
    names, file = example(), tmp_path / "body.fmu"
    export(load_scene(names["scene"]), file, ["buoy"])
    places = [f"buoy.{x}" for x in ("x", "y", "z", "q0", "q1", "q2", "q3")]

    class Coupled(Slave):
        def __init__(self, scene, driven):
            super().__init__(file, tmp_path / "fmu")
            self.setInt32([self.places["extrapolation"]], [0])
            self.kept = None

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.freeFMUState(self.kept)
            self.freeInstance()

        def save(self):
            self.kept = self.kept and self.freeFMUState(self.kept)
            self.kept = self.getFMUState()
            return self.kept

        restore = FMU3Slave.setFMUState

        def state(self, name):
            position, q = np.split(self.read(*places), [3])
            return BodyState(position, q / np.linalg.norm(q), None, None)

        def drive(self, name, position, orientation):
            self.setFloat64([self.places[x] for x in places], [*map(float, position), *map(float, orientation)])

        def step(self, dt):
            self.doStep(self.read("time")[0], dt)

        def pulls(self, name):
            return Wrench(*np.split(self.read(*(f"buoy.{f}" for f in ("fx", "fy", "fz", "mx", "my", "mz"))), 2))

    names["dolfbuoy"] = SimpleNamespace(Session=Coupled)
    assert furthest(names["coupled"]()) < 1e-6


def test_what_is_not_possible_is_refused(tmp_path, call):
    with pytest.raises(InputError, match="no such thing"):
        export(load_scene(LINE), tmp_path / "no.fmu", ["top"])
    code, _, error = call("fmu", "driven", "--out", tmp_path / "no.zip")
    assert code == 2
    assert "must end in .fmu" in error
    assert not list(tmp_path.iterdir())


def test_a_step_that_is_not_possible_is_a_status_and_a_message(line, tmp_path, capfd):
    slave = Slave(line, tmp_path / "fmu")
    slave.write(cable__to__z=float("nan"))
    with pytest.raises(Exception, match="fmi3DoStep"):
        slave.doStep(0.0, 0.02)
    slave.freeInstance()
    assert "nan]: must be 3 numbers" in capfd.readouterr().out


def test_a_winch_is_that_of_a_session(tmp_path):
    """Length is an input; mean line tension is an output, between those of the ends."""
    file = tmp_path / "winch.fmu"
    export(load_scene(LINE), file, ["cable.winch", "cable.to"])
    assert validate_fmu(str(file)) == []
    slave = Slave(file, tmp_path / "fmu")
    slave.setInt32([slave.places["extrapolation"]], [0])
    names = ("cable.winch.tension", "cable.to.fx", "cable.tension_top", "cable.tension_anchor")
    with Session(LINE, driven=["cable.winch", "cable.to"]) as s:
        length = float(s.paths["cable.winch"].end[1][0])
        assert slave.read("cable.winch.length") == length
        first = slave.read("cable.winch.tension").item()
        for k in range(10):
            found, values = slave.read(*names), s.values()
            tension, pull = s.pull("cable.winch").item(), s.pull("cable.to")[0]
            np.testing.assert_allclose(
                found, [tension, pull, *values["tension_top"], *values["tension_anchor"]], rtol=1e-14
            )
            assert found[3] < found[0] < found[2]
            paid = length - 0.001 * (k + 1) ** 2
            s.drive("cable.winch", paid)
            s.step(0.02)
            slave.write(cable__winch__length=paid)
            slave.doStep(0.02 * k, 0.02)
    assert found[0] > 1.02 * first  # it was wound in
    slave.terminate()
    slave.freeInstance()
