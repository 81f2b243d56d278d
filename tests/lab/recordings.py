"""One recording in every format, each column around a value of its own, so that a shifted column shows."""

import warnings

import numpy as np

RATE = 2000.0
COUNT = 300
CENTRES = {"motor": 100.0, "edge": 300.0, "skin": 500.0}
"""Each channel lies within 50 of its centre."""


def columns(count=COUNT):
    """Three channels (count, 3); whole numbers of 1/64, which every format holds exactly."""
    time = np.arange(count) / RATE
    waves = [np.sin(2 * np.pi * 125.0 * time + k) for k in range(3)]
    return np.round(np.column_stack([c + 50 * w for c, w in zip(CENTRES.values(), waves, strict=True)]) * 64) / 64


def write_text(path, delimiter=",", decimal=".", end="", quote=""):
    rows = np.column_stack([np.arange(COUNT) / RATE, columns()])
    lines = ["Device;X 1", "Comment: made up", delimiter.join(["Time (s)", *(f"{name} (um)" for name in CENTRES)])]
    lines += [delimiter.join(f"{quote}{v:.6f}{quote}".replace(".", decimal) for v in row) + end for row in rows]
    path.write_text("\n".join(lines) + "\n")


def write_universal(path, binary=1):
    import pyuff

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sets = [
            {
                "type": 58, "binary": binary, "func_type": 1, "rsp_node": i + 1, "rsp_dir": 3, "ref_dir": 0,
                "ref_node": 0, "data": columns()[:, i], "x": np.arange(COUNT) / RATE, "abscissa_spacing": 1,
                "abscissa_min": 0, "abscissa_inc": 1 / RATE, "num_pts": COUNT, "id1": name, "rsp_ent_name": name,
                "ref_ent_name": "NONE",
                "ordinate_axis_lab": name, "ordinate_axis_units_lab": "um", "abscissa_spec_data_type": 17,
                "ordinate_spec_data_type": 8, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0,
            }
            for i, name in enumerate(CENTRES)
        ]  # fmt: skip
        path.unlink(missing_ok=True)  # its mode "overwrite" loses the first header of a binary file
        pyuff.UFF(str(path)).write_sets(sets, mode="add")


def write_tdms(path):
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(str(path)) as writer:
        properties = {"wf_increment": 1 / RATE, "unit_string": "um"}
        writer.write_segment(
            [ChannelObject("log", name, columns()[:, i], properties=properties) for i, name in enumerate(CENTRES)]
        )


def write_mat(path):
    from scipy.io import savemat

    savemat(path, {name: columns()[:, i : i + 1] for i, name in enumerate(CENTRES)}, do_compression=True)


def write_hdf5(path, matlab=False):
    import h5py

    with h5py.File(path, "w", userblock_size=512 if matlab else 0) as file:
        for i, name in enumerate(CENTRES):
            file[name] = columns()[:, i][None] if matlab else columns()[:, i]
            if not matlab:
                file[name].attrs["units"] = "um"
    if matlab:
        with open(path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_wav(path, kind="<f4"):
    from scipy.io import wavfile

    data = columns() if kind == "<f4" else columns() * 50
    wavfile.write(path, int(RATE), data.astype(kind))


FORMATS = {
    "comma.csv": write_text,
    "semicolon.csv": lambda path: write_text(path, ";", ","),
    "tab.txt": lambda path: write_text(path, "\t"),
    "trailing.csv": lambda path: write_text(path, ",", end=","),
    "quoted.csv": lambda path: write_text(path, ",", ",", quote='"'),
    "binary.uff": write_universal,
    "ascii.unv": lambda path: write_universal(path, 0),
    "logger.tdms": write_tdms,
    "v5.mat": write_mat,
    "v73.mat": lambda path: write_hdf5(path, matlab=True),
    "plain.h5": write_hdf5,
    "float.wav": write_wav,
    "int.wav": lambda path: write_wav(path, "<i2"),
}


def hangs(*asked):
    """Stand in for a library that never returns."""
    import time

    time.sleep(60)


def mutated(content, rng):
    """Change, insert, remove, copy or cut off some bytes.

    Bytes removed in one place and as many inserted in another are no damage that a format without checksums shows.
    """
    data = bytearray(content)
    moves = rng.random() < 0.6
    for _ in range(rng.integers(1, 4)):
        at, other = rng.integers(0, len(data), 2)
        end = at + rng.integers(1, 9)
        kinds = [(at + 1, rng.bytes(1)), (at + 1, rng.choice(list(b"\n,;\t .0-\xff\x00"), 1).astype("u1").tobytes())]
        kinds += [(end, data[other : other + end - at])]
        kinds += [(end, b""), (at, data[at:end]), (len(data) if rng.random() < 0.3 else at, b"")] if moves else []
        last, fresh = kinds[rng.integers(0, len(kinds))]
        data[at:last] = fresh
    return mutated(content, rng) if moves and len(data) == len(content) else bytes(data)
