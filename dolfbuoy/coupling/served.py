"""The functions of dolfbuoy.h, called by the shared library in its embedded Python."""

import sys
import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import InputError, SolveError
from ..scene import parse_assignment
from .paths import Array, Pose
from .saved import Saved
from .session import Session

#: Ending of the name of a driven length.
WINCH = ".winch"
DONE, FAILED, REFUSED, BROKEN = 0, 1, 2, 3


class Client:
    """A session as seen by a C program: set up step by step, then opened; with arrays of all driven parts."""

    def __init__(self, scene: str) -> None:
        self.scene = scene
        self.changes: dict[str, Any] = {}
        self.names: list[str] = []
        self.folder: str | None = None
        self.message: Any = None
        self._session: Session | None = None
        self._saved: dict[int, Saved] = {}
        self._count = 0

    @property
    def session(self) -> Session:
        """The Session, once opened."""
        if self._session is None:
            raise InputError("dolfbuoy_init must be called before.")
        return self._session

    def choose(self, place: Callable[[], object]) -> None:
        """Make a choice that must precede the opening of the session."""
        if self._session is not None:
            raise InputError("dolfbuoy_init was called already: the scene can no longer be changed.")
        place()

    def open(self) -> None:
        """Open the session, which finds the equilibrium."""
        self.choose(lambda: None)
        self._session = Session(self.scene, self.folder, driven=self.names, **self.changes)

    def bodies(self) -> list[bool]:
        """For each driven part, True if it is a body."""
        paths = self.session.paths
        return [isinstance(paths[name], Pose) for name in self.names]

    def counts(self) -> list[tuple[int, int]]:
        """Sizes of x, and of v or f, of each driven part; a winch has a length, its rate and a tension."""
        pairs = zip(self.names, self.bodies(), strict=True)
        return [(7, 6) if body else (1, 1) if name.endswith(WINCH) else (3, 3) for name, body in pairs]

    def sizes(self) -> tuple[int, int]:
        """Total sizes of x, and of v or f."""
        counts = self.counts()
        return sum(of_x for of_x, _ in counts), sum(of_v for _, of_v in counts)

    def places(self) -> Array:
        """Positions x of all driven parts."""
        return np.concatenate([np.zeros(0), *(self.session.paths[name].end[1] for name in self.names)])

    def forces(self) -> Array:
        """Forces f of all driven parts."""
        s = self.session
        pairs = zip(self.names, self.bodies(), strict=True)
        return np.concatenate(
            [np.zeros(0), *(np.ravel(s.pulls(name) if body else s.pull(name)) for name, body in pairs)]
        )

    def step(self, x: Array, v: Array | None, dt: float) -> None:
        """Drive all parts to x and advance by dt."""
        at = of_v = 0
        for name, (count, speeds) in zip(self.names, self.counts(), strict=True):
            place, speed = x[at : at + count], None if v is None else v[of_v : of_v + speeds]
            if count == 7:
                rates = [None, None] if speed is None else [speed[:3], speed[3:]]
                self.session.drive(name, place[:3], place[3:], *rates)
            else:
                self.session.drive(name, place, velocity=speed)
            at, of_v = at + count, of_v + speeds
        self.session.step(dt)

    def values(self, quantity: str, count: int) -> Array:
        """Values of a recorded quantity.  Raises InputError."""
        known = self.session.values()
        found = known.get(quantity)
        if found is None or np.size(found) != count:
            sizes = ", ".join(f"{name} ({np.size(values)})" for name, values in known.items())
            raise InputError(f"{quantity!r} with {count} numbers: must be of {sizes}.")
        return np.ravel(found)

    def save(self) -> int:
        """Save the present instant; returns its number."""
        self._count += 1
        self._saved[self._count] = self.session.save()
        return self._count

    def restore(self, number: int) -> None:
        """Return to the instant of this number.  Raises InputError for an unknown number."""
        self.session.restore(self._known(number))

    def forget(self, number: int) -> None:
        """Free the memory of a saved instant.  Raises InputError for an unknown number."""
        self._known(number)
        del self._saved[number]

    def pack(self, number: int) -> bytes:
        """The instant of this number as bytes."""
        return self.session.pack(self._known(number))

    def unpack(self, content: bytes) -> int:
        """Save the instant in bytes from `pack`; returns its number."""
        saved = self.session.unpack(content)
        self._count += 1
        self._saved[self._count] = saved
        return self._count

    def _known(self, number: int) -> Saved:
        if number not in self._saved:
            raise InputError(f"number = {number}: must be one that dolfbuoy_save gave, and not forgotten.")
        return self._saved[number]

    def close(self) -> None:
        """End the session, if it is open."""
        if self._session is not None:
            self._session.close()


def serve(ffi: Any) -> None:
    """Register the functions that the library calls; ffi: of its compiled declarations."""
    alive: dict[int, Any] = {}
    if not getattr(sys, "argv", None) or not sys.argv[0]:
        sys.argv = ["libdolfbuoy"]

    def text(pointer: Any) -> str:
        return str(ffi.string(pointer).decode())

    def read(pointer: Any, count: int) -> Array:
        return np.frombuffer(ffi.buffer(pointer, 8 * count)).copy() if count else np.zeros(0)

    def write(pointer: Any, values: Array) -> None:
        if pointer != ffi.NULL and len(values):
            ffi.buffer(pointer, 8 * len(values))[:] = np.ascontiguousarray(values, dtype=float).tobytes()

    def function(do: Callable[..., object]) -> None:
        """Let C call dolfbuoy_NAME, a function of a Client; errors become codes and a message."""

        def call(pointer: Any, *arguments: Any) -> int:
            client, code = ffi.from_handle(ffi.cast("void *", pointer)), DONE
            try:
                do(client, *arguments)
            except Exception as error:
                code = REFUSED if isinstance(error, InputError) else FAILED if isinstance(error, SolveError) else BROKEN
                sentence = str(error) if code != BROKEN else "".join(traceback.format_exception(error))
                client.message = ffi.new("char[]", sentence.encode())
            return code

        ffi.def_extern(name=f"dolfbuoy_{do.__name__.rstrip('_')}", error=BROKEN)(call)

    def create(scene: Any) -> Any:
        handle = ffi.new_handle(Client(text(scene)))
        pointer = ffi.cast("dolfbuoy *", handle)
        alive[int(ffi.cast("uintptr_t", pointer))] = handle
        return pointer

    def message(pointer: Any) -> Any:
        client = ffi.from_handle(ffi.cast("void *", pointer))
        client.message = client.message or ffi.new("char[]", b"")
        return client.message

    ffi.def_extern(name="dolfbuoy_create")(create)
    ffi.def_extern(name="dolfbuoy_message")(message)

    @function
    def set_(client: Client, assignment: Any) -> None:
        client.choose(lambda: client.changes.update([parse_assignment(text(assignment))]))

    @function
    def drive(client: Client, name: Any) -> None:
        client.choose(lambda: client.names.append(text(name)))

    @function
    def record(client: Client, folder: Any) -> None:
        client.choose(lambda: setattr(client, "folder", text(folder)))

    @function
    def init(client: Client) -> None:
        client.open()

    @function
    def sizes(client: Client, of_x: Any, of_v: Any) -> None:
        of_x[0], of_v[0] = client.sizes()

    @function
    def now(client: Client, t: Any, x: Any, f: Any) -> None:
        write(t, np.array([client.session.t]))
        write(x, client.places())
        write(f, client.forces())

    @function
    def step(client: Client, x: Any, v: Any, f: Any, t: Any, dt: float) -> None:
        of_x, of_v = client.sizes()
        client.step(read(x, of_x), None if v == ffi.NULL else read(v, of_v), dt)
        write(f, client.forces())
        write(t, np.array([client.session.t]))

    @function
    def load(client: Client, name: Any, force: Any, moment: Any) -> None:
        force, moment = (np.zeros(3) if one == ffi.NULL else read(one, 3) for one in (force, moment))
        client.session.load(text(name), force, moment)

    @function
    def state(client: Client, buoy: Any, numbers: Any) -> None:
        write(numbers, np.concatenate(client.session.state(text(buoy))))

    @function
    def values(client: Client, quantity: Any, numbers: Any, count: int) -> None:
        write(numbers, client.values(text(quantity), count))

    @function
    def elevation(client: Client, points: Any, count: int, numbers: Any) -> None:
        flat = read(points, 2 * count).reshape(count, 2)
        write(numbers, client.session.elevation(np.column_stack([flat, np.zeros(count)])))

    @function
    def save(client: Client, number: Any) -> None:
        number[0] = client.save()

    @function
    def restore(client: Client, number: int) -> None:
        client.restore(number)

    @function
    def forget(client: Client, number: int) -> None:
        client.forget(number)

    @function
    def pack(client: Client, number: int, content: Any, count: Any) -> None:
        found = client.pack(number)
        if content != ffi.NULL:
            if count[0] < len(found):
                raise InputError(f"count = {count[0]}: must be {len(found)} bytes at least.")
            ffi.buffer(content, len(found))[:] = found
        count[0] = len(found)

    @function
    def unpack(client: Client, content: Any, count: int, number: Any) -> None:
        number[0] = client.unpack(bytes(ffi.buffer(content, count)))

    @function
    def close(client: Client) -> None:
        client.close()
        for number, handle in list(alive.items()):
            if ffi.from_handle(handle) is client:
                del alive[number]
