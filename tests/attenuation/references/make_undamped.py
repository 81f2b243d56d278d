"""Makes undamped.json: responses that a polynomial through six small losses missed by more than its error said.

Of two random media, by unitcad.accuracy.ball_reference, which takes minutes.

    python tests/attenuation/references/make_undamped.py
"""

import json
from pathlib import Path

from unitcad.accuracy.ball_reference import response
from unitcad.accuracy.random_media import trial

MEDIA = (("undamped", 609318770010), ("extreme contrast", 609318770025))

if __name__ == "__main__":
    values = []
    for kind, seed in MEDIA:
        one = trial(kind, seed)
        exact = response(one.medium, one.load, one.omega, one.r, one.z)
        u = [[[value.real, value.imag] for value in row] for row in exact.u]
        values.append({"kind": kind, "seed": seed, "u": u, "doubt": exact.doubt.tolist()})
    Path(__file__).with_name("undamped.json").write_text(json.dumps(values, indent=1) + "\n")
