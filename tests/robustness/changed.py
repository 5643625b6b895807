"""Import of one module from another text than its file's."""

import importlib.machinery
import importlib.util
import sys
from pathlib import Path


class Given(importlib.machinery.SourceFileLoader):
    """Loads a module from a text."""

    def __init__(self, name, path, source):
        super().__init__(name, path)
        self.source = source

    def get_code(self, fullname):
        return compile(self.source, self.path, "exec", dont_inherit=True)


def install(name: str, path: str, source: str) -> None:
    """Let this module be imported from `source`, at its place."""
    inside = [str(Path(path).parent)] if Path(path).stem == "__init__" else None

    class Finder:
        @staticmethod
        def find_spec(wanted, *_):
            if wanted != name:
                return None
            loader = Given(name, path, source)
            return importlib.util.spec_from_file_location(name, path, loader=loader, submodule_search_locations=inside)

    sys.meta_path.insert(0, Finder)
