"""The functions of dolfbuoy.h, called as C calls them, by pointers: codes, numbers and messages."""

import numpy as np
from cffi import FFI
from told import MOORED, SHIP, show

from dolfbuoy import load_scene
from dolfbuoy.coupling.served import serve

functions = {}


class Library:
    """What the compiled declarations of the library give; its functions stay here."""

    def __init__(self):
        self._ffi = FFI()
        self._ffi.cdef("typedef struct dolfbuoy dolfbuoy;")

    def __getattr__(self, name):
        return getattr(self._ffi, name)

    def def_extern(self, name, error=None):
        return lambda function: functions.setdefault(name.removeprefix("dolfbuoy_"), function)


ffi = Library()
serve(ffi)


def call(pointer, name, *arguments):
    """Call a function, and tell what it returns and what it says then."""
    code = functions[name](pointer, *arguments)
    said = ffi.string(functions["message"](pointer)).decode().splitlines()
    print(name, code, *said[-1:] if code else ())
    return code


def text(words):
    return ffi.new("char[]", words.encode())


def numbers(values):
    return ffi.new("double[]", [float(x) for x in values])


def read(name, pointer, count):
    show({name: np.frombuffer(ffi.buffer(pointer, 8 * count))})


def opened(scene, driven, changes=()):
    """A session with what it drives."""
    load_scene(scene).save("scene.toml")
    pointer = functions["create"](text("scene.toml"))
    for change in changes:
        call(pointer, "set", text(change))
    for name in driven:
        call(pointer, "drive", text(name))
    call(pointer, "init")
    return pointer


def now(pointer):
    """Sizes, and all numbers of an instant."""
    sizes = ffi.new("int[2]")
    call(pointer, "sizes", sizes, sizes + 1)
    print("sizes", *sizes)
    t, x, f = numbers([0]), numbers([0] * sizes[0]), numbers([0] * sizes[1])
    call(pointer, "now", t, x, f)
    for name, array, count in (("t", t, 1), ("x", x, sizes[0]), ("f", f, sizes[1])):
        read(name, array, count)
    return list(x), sizes[1]


def ship():
    pointer = opened(SHIP, ["ship", "fore.from", "aft.winch"], ["time.step=0.05", "nothing", "time.step"])
    x, count = now(pointer)
    t, f, v = numbers([0]), numbers([0] * count), numbers(np.arange(count) * 0.01)
    x[0] += 0.01
    x[-1] -= 0.02
    call(pointer, "step", numbers(x), ffi.NULL, f, t, 0.05)
    read("t", t, 1)
    read("f", f, count)
    call(pointer, "load", text("Y"), numbers([5.0, 1.0, 2.0]), ffi.NULL)
    number = ffi.new("int[1]")
    call(pointer, "save", number)
    call(pointer, "step", numbers(x), v, f, ffi.NULL, 0.05)
    read("f", f, count)
    size = ffi.new("int[1]")
    call(pointer, "pack", number[0], ffi.NULL, size)
    needed, content = size[0], ffi.new("char[]", size[0] + 9)
    size[0] = needed - 1
    call(pointer, "pack", number[0], content, size)
    size[0] = needed + 9
    call(pointer, "pack", number[0], content, size)
    print("all of it", size[0] == needed)
    call(pointer, "forget", number[0])
    call(pointer, "restore", number[0])
    call(pointer, "unpack", content, needed, number)
    print("number", number[0])
    call(pointer, "restore", number[0])
    call(pointer, "step", numbers(x), v, f, ffi.NULL, 0.05)
    read("f", f, count)
    length = numbers([0])
    call(pointer, "values", text("take_off_length"), length, 1)
    read("take_off_length", length, 1)
    call(pointer, "values", text("take_off_length"), length, 2)
    call(pointer, "values", text("nothing"), length, 1)
    call(pointer, "step", numbers(x), ffi.NULL, f, t, -1.0)
    for late in ("set", "drive", "record"):
        call(pointer, late, text("time.step=0.1"))
    call(pointer, "init")
    call(pointer, "state", text("ship"), length)
    print("close", functions["close"](pointer))


def buoy():
    pointer = opened(MOORED, [])
    now(pointer)
    call(pointer, "load", text("buoy"), numbers([500.0, 0.0, 0.0]), numbers([0.0, 10.0, 0.0]))
    call(pointer, "step", ffi.NULL, ffi.NULL, ffi.NULL, ffi.NULL, 0.05)
    state, heights = numbers([0] * 13), numbers([0, 0])
    call(pointer, "state", text("buoy"), state)
    read("state", state, 13)
    call(pointer, "elevation", numbers([0.0, 0.0, 5.0, -3.0]), 2, heights)
    read("elevation", heights, 2)
    print("close", functions["close"](pointer))
    pointer = opened(MOORED, ["buoy"])
    x, count = now(pointer)
    f = numbers([0] * count)
    call(pointer, "step", numbers(x), numbers([0.0] * count), f, ffi.NULL, 0.05)
    read("f", f, count)
    print("close", functions["close"](pointer))
    pointer = functions["create"](text("missing.toml"))
    call(pointer, "sizes", ffi.new("int[1]"), ffi.new("int[1]"))
    call(pointer, "init")
    print("close", functions["close"](pointer))


ship()
buoy()
