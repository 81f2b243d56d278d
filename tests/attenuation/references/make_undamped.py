"""Makes undamped.json: responses of random media that were missed by more than their error said, or met no small rtol.

The first two are those that a polynomial through six small losses missed. In the others poles lie next to a branch
point or are known to few digits. By benchmarks.accuracy.ball_reference, which takes minutes.

    python tests/attenuation/references/make_undamped.py
"""

import json
from pathlib import Path

from benchmarks.accuracy.ball_reference import response
from unitcad.accuracy.random_media import trial

MEDIA = (
    ("undamped", 609318770010),
    ("extreme contrast", 609318770025),
    ("undamped", 482719030004),
    ("wide contrast", 482719030045),
    ("extreme contrast", 731905),
)

if __name__ == "__main__":
    values = []
    for kind, seed in MEDIA:
        one = trial(kind, seed)
        exact = response(one.medium, one.load, one.omega, one.r)
        u = [[[value.real, value.imag] for value in row] for row in exact.u]
        values.append({"kind": kind, "seed": seed, "u": u, "doubt": exact.doubt.tolist()})
    Path(__file__).with_name("undamped.json").write_text(json.dumps(values, indent=1) + "\n")
