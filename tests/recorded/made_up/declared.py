"""Outputs and effects as they are declared, and what the schema of the scene language allows."""

from dolfbuoy.model.effects import EFFECTS
from dolfbuoy.results.quantities import QUANTITIES
from dolfbuoy.scene.schema import schema

for one in (*QUANTITIES.values(), *EFFECTS):
    plain = {key: value for key, value in vars(one).items() if not callable(value) and value not in (None, "", ())}
    print(*(f"{key}={value!r}" for key, value in plain.items() if " at 0x" not in repr(value)))
whole = schema()
for name, model in {"": whole, **whole["$defs"]}.items():
    for key, rule in model.get("properties", {}).items():
        print(f"{name}.{key}", *(f"{word}={value}" for word, value in rule.items() if word != "description"))
