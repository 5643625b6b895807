"""State of a Session at an instant: copies of its data, and bytes that another session of the scene can read."""

import base64
import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InputError
from .paths import Wrench

if TYPE_CHECKING:
    from .session import Session

#: Attributes of a Session that belong to an instant, besides the Simulation.
OWN = ("_series", "_required", "_targets")


class Saved(NamedTuple):
    """State of a Session at an instant, for `restore`."""

    session: int
    state: dict[str, Any]
    assembled: int
    own: dict[str, Any]
    mark: dict[str, Any] | None


def copied(tree: Any) -> Any:
    """A copy of nested dicts and lists of arrays and numbers."""
    if isinstance(tree, dict):
        return {key: copied(item) for key, item in tree.items()}
    if isinstance(tree, list):
        return [copied(item) for item in tree]
    return tree.copy() if isinstance(tree, np.ndarray) else tree


def own_of(session: "Session") -> dict[str, Any]:
    """A copy of the session's data of an instant, besides the Simulation."""
    system = session.simulation.system
    return {name: copied(getattr(session, name)) for name in OWN} | {
        "loads": system.loads.copy() if "loads" in vars(system) else 0.0,
        "functions": {name: force.function for name, force in session._forces.items()},
        "paths": {name: dict(vars(path)) for name, path in session.paths.items()},
    }


def put_back(session: "Session", own: dict[str, Any]) -> None:
    """Restore everything from `own_of` except functions."""
    for name in OWN:
        setattr(session, name, copied(own[name]))
    for name, path in session.paths.items():
        vars(path).update(own["paths"][name])
    system = session.simulation.system
    if "loads" in vars(system) or np.any(own["loads"]):
        system.loads[:] = own["loads"]


def kept(session: "Session") -> dict[str, Any]:
    """`own_of` for a checkpoint, without Python functions and their loads, which must be given again."""
    own = own_of(session)
    own["functions"] = [name for name, force in session._forces.items() if force.function is not None]
    for name in own["functions"]:
        own["loads"][session._forces[name].rows] = 0.0
    for path in own["paths"].values():
        path["function"] = None
    return {"session": json.dumps(_plain(own))}


def take_up(session: "Session", state: dict[str, Any]) -> bool:
    """Continue from the result of `kept` in a checkpoint; False if other parts were driven."""
    try:
        own = _tree(json.loads(state.get("session", '{"dict": [["paths", {"dict": []}]]}')))
        same = {*own["paths"]} == {*session.paths}
        if same and "functions" in own:
            if any({*own["paths"][name]} != {*vars(path)} for name, path in session.paths.items()):
                raise ValueError("paths of another version")
            put_back(session, own | {"_required": _wrenches(own["_required"])})
            session._awaited = {(session.t, name) for name in own["functions"]}
            return True
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError("The checkpoint's session is not one of this scene: it can only begin anew.") from None
    if session.carried:
        before = ", ".join(own["paths"]) or "nothing"
        raise InputError(f"driven: a vessel's pose is known of a session that drove the same: {before}.")
    return False


def _wrenches(required: dict[str, Any]) -> dict[str, Wrench]:
    return {name: Wrench(*pair) for name, pair in required.items()}


def pack(session: "Session", saved: Saved) -> bytes:
    """See `Session.pack`."""
    if saved.mark is not None:
        raise InputError("pack: the session writes a record, which another one would not go on with.")
    tree = {"scene": session.scene.to_toml(), "driven": list(session.paths), "state": saved.state, "own": saved.own}
    return json.dumps(_plain(tree), separators=(",", ":")).encode()


def unpack(session: "Session", content: bytes) -> Saved:
    """See `Session.unpack`.  Runs no code from the bytes, which need not be trusted."""
    try:
        tree = _tree(json.loads(content))
        scene, driven, state, own = (tree[name] for name in ("scene", "driven", "state", "own"))
        own["_required"] = _wrenches(own["_required"])
        if {*own} != {*OWN, "loads", "functions", "paths"} or not isinstance(state, dict):
            raise ValueError("parts are missing")
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise InputError("unpack: the bytes are not those of a packed state.") from None
    if (scene, driven) != (session.scene.to_toml(), list(session.paths)):
        raise InputError("unpack: the state is of another scene, or of one that drives other things.")
    if any({*own["paths"].get(name, ())} != {*vars(path)} for name, path in session.paths.items()):
        raise InputError("unpack: the state is one of another version.")
    return Saved(id(session), state, -1, own, None)


def _plain(tree: Any) -> Any:
    if tree is None or isinstance(tree, bool | int | float | str):
        return tree
    if isinstance(tree, np.ndarray):
        content = base64.b64encode(np.ascontiguousarray(tree).tobytes()).decode()
        return {"array": content, "dtype": tree.dtype.str, "shape": list(tree.shape)}
    if isinstance(tree, np.generic):
        return _plain(tree.item())
    if isinstance(tree, list):
        return [_plain(item) for item in tree]
    if isinstance(tree, tuple):
        return {"tuple": [_plain(item) for item in tree]}
    if isinstance(tree, dict):
        return {"dict": [[key, _plain(item)] for key, item in tree.items()]}
    raise InputError("pack: what is moved or loaded by a function of Python cannot be packed: give numbers instead.")


def _tree(plain: Any) -> Any:
    if isinstance(plain, list):
        return [_tree(item) for item in plain]
    if not isinstance(plain, dict):
        return plain
    if "dict" in plain:
        return {key: _tree(item) for key, item in plain["dict"]}
    if "tuple" in plain:
        return tuple(_tree(item) for item in plain["tuple"])
    kind = np.dtype(plain["dtype"])
    if kind.kind not in "biuf":
        raise ValueError("numbers only")
    return np.frombuffer(base64.b64decode(plain["array"], validate=True), kind).reshape(plain["shape"]).copy()
