"""Results kept on disk, one file per case, so that an interrupted benchmark goes on where it was."""

import hashlib
import json
from pathlib import Path


def kept(evaluate, case: dict, folder: Path, say=None) -> dict:
    """evaluate(case), or what it gave before; case and result hold what JSON can."""
    key = hashlib.sha256(json.dumps(case, sort_keys=True).encode()).hexdigest()[:20]
    file = Path(folder) / "cases" / f"{key}.json"
    if not file.is_file():
        if say is not None:
            say(case)
        file.parent.mkdir(parents=True, exist_ok=True)
        result = evaluate(case)
        part = file.with_suffix(".part")
        part.write_text(json.dumps({"case": case, "result": result}))
        part.replace(file)
    return json.loads(file.read_text())["result"]
