"""Units that recordings state, in every reader: by the usual keys in any case and place, or refused; never skipped.

The motor's numbers are in mm/s and the edge's in um/s. A unit that is lost makes the level wrong by 1000.
"""

import h5py
import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from scipy.io import savemat, wavfile

from tests.refusals import refuses
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import measure
from unitcad.lab.readers import open_recording
from unitcad.lab.units import is_signal_unit, plain

RATE, LEVEL = 4096.0, 0.37
TIME = np.arange(2048) / RATE


def samples(i, edge=1000.0):
    """Return the motor in mm/s and the edge, `edge` times as large as in mm/s, of repeat `i`."""
    noise = np.random.default_rng(i).standard_normal((2, len(TIME)))
    wave = np.cos(2 * np.pi * 137.4 * TIME + i)
    return 240 * wave + noise[0], edge * (LEVEL * 240 * wave + noise[1])


def hdf5(write):
    def make(path, i):
        with h5py.File(path, "w") as file:
            write(file, *samples(i))

    return "h5", make


def datasets(file, motor, edge, group="Rec/"):
    file[f"{group}Motor"], file[f"{group}Edge"] = motor, edge
    return file[f"{group}Motor"], file[f"{group}Edge"]


def attributes(key, form=str):
    def write(file, *both):
        for node, unit in zip(datasets(file, *both), ("mm/s", "um/s"), strict=True):
            node.attrs[key] = form(unit)

    return hdf5(write)


def own_groups(file, motor, edge, how="attribute"):
    for name, x, unit in (("Motor", motor, "mm/s"), ("Edge", edge, "µm/s")):
        file[f"Rec/{name}/Data"] = x
        if how == "attribute":
            file[f"Rec/{name}"].attrs["UNIT"] = unit
        else:
            file[f"Rec/{name}/Units"] = unit


def beside(file, motor, edge):
    datasets(file, motor, edge)
    file["Rec/Edge_Units"], file["Rec/Motor_Units"] = "um/s", "mm/s"


def named_by_the_group(file, motor, edge):
    datasets(file, motor, edge)
    file["Rec"].attrs["edge unit"], file["Rec"].attrs["motor unit"] = "um/s", "mm/s"


def inherited(file, motor, edge):
    node, _ = datasets(file, motor, edge)
    file.attrs["Physical_Unit"], node.attrs["unit"] = "um/s", "mm/s"


def of_columns(units):
    def write(file, motor, edge):
        file["Data"] = np.column_stack([motor, edge])
        file["Data"].attrs["ColumnUnits" if units is None else "Units"] = ["mm/s", "um/s"] if units is None else units

    return write


def table_of_units(file, motor, edge):
    datasets(file, motor, edge)
    file["Units/Motor"], file["Units/Edge"] = "mm/s", "um/s"


def two_units(file, motor, edge):
    for node in datasets(file, motor, edge):
        node.attrs["unit"], node.attrs["Units"] = "mm/s", "um/s"


def set_unit(key, value):
    def write(file, motor, edge):
        for node in datasets(file, motor, edge):
            node.attrs[key] = value

    return hdf5(write)


def mat(variables):
    def make(path, i):
        savemat(path, variables(*samples(i)))

    return "mat", make


def struct_array(motor, edge):
    channels = np.zeros((1, 2), dtype=[("Data", object), ("Unit", object)])
    channels[0, 0] = (motor[:, None], "mm/s")
    channels[0, 1] = (edge[:, None], "um/s")
    return {"Channel": channels}


def y_values(motor, edge):
    def signal(x, unit):
        return {"y_values": {"values": x[:, None], "quantity": {"label": unit}, "Unit": {"label": unit}}}

    return {"Motor": signal(motor, "mm/s"), "Edge": signal(edge, "um/s")}


def mat73(write):
    def make(path, i):
        with h5py.File(path, "w", userblock_size=512) as file:
            write(file, *samples(i))
        with open(path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")

    return "mat", make


def characters(file, name, text):
    file[name] = np.array([[ord(letter)] for letter in text], "u2")
    file[name].attrs["MATLAB_class"] = np.bytes_("char")


def structs73(file, motor, edge):
    for name, x, unit in (("Motor", motor, "mm/s"), ("Edge", edge, "um/s")):
        file[f"{name}/Data"] = x[None]
        characters(file, f"{name}/Unit", unit)


def struct_array73(file, motor, edge):
    for k, (x, unit) in enumerate(((motor, "mm/s"), (edge, "um/s"))):
        file[f"#refs#/d{k}"] = x[None]
        characters(file, f"#refs#/u{k}", unit)
    for field, letter in (("Data", "d"), ("Unit", "u")):
        made = file.create_dataset(f"Channel/{field}", (2, 1), h5py.ref_dtype)
        for k in range(2):
            made[k, 0] = file[f"#refs#/{letter}{k}"].ref


def tdms(keys, group=None, root=None):
    def make(path, i):
        both = samples(i)
        with TdmsWriter(str(path)) as writer:
            channels = [
                ChannelObject(
                    "log", name, x, {"wf_increment": 1 / RATE, **{key: unit[k] for key, unit in keys.items()}}
                )
                for k, (name, x) in enumerate(zip(("Motor", "Edge"), both, strict=True))
            ]
            writer.write_segment([RootObject(root or {}), GroupObject("log", group or {}), *channels])

    return "tdms", make


def universal(label, code=None, kind=11):
    def make(path, i):
        import pyuff

        sets = []
        if code is not None:
            sets.append({"type": 164, "units_code": 5, "length": code, "force": 1.0, "temp": 1.0, "temp_offset": 0.0})
        both = samples(i, 1000.0 if label else 1.0)
        factor = 1e-3 * code if code and not label else 1.0
        for k, x in enumerate(both):
            sets.append(
                {
                    "type": 58, "binary": 0, "func_type": 1, "rsp_node": k + 1, "rsp_dir": 3, "ref_dir": 0,
                    "ref_node": 0, "data": x * factor, "x": TIME, "abscissa_spacing": 1, "abscissa_min": 0,
                    "abscissa_inc": 1 / RATE, "num_pts": len(x), "id1": "a", "rsp_ent_name": ("Motor", "Edge")[k],
                    "ref_ent_name": "NONE", "ordinate_axis_lab": ("Motor", "Edge")[k],
                    "ordinate_axis_units_lab": label[k] if label else "NONE", "abscissa_spec_data_type": 17,
                    "ordinate_spec_data_type": kind, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0,
                }
            )  # fmt: skip
        pyuff.UFF(str(path)).write_sets(sets, mode="add")

    return "uff", make


def text(head, delimiter=",", time=True, ending="csv", end="", row="{}"):
    def make(path, i):
        lines = [
            delimiter.join(f"{v:.9g}" for v in ([t] if time else []) + [m, e])
            for t, m, e in zip(TIME, *samples(i), strict=True)
        ]
        path.write_text("\n".join([*head, *(row.format(line) + end for line in lines)]) + "\n", encoding="utf-8")

    return ending, make


def wav(remark, kind="<f4"):
    """Write a WAV file with a remark in its INFO chunk."""

    def make(path, i):
        both = np.column_stack(samples(i))
        wavfile.write(path, int(RATE), both.astype(kind))
        text = remark.encode() + b"\0" * (len(remark) % 2)
        info = b"INFOICMT" + len(remark).to_bytes(4, "little") + text
        content = path.read_bytes() + b"LIST" + len(info).to_bytes(4, "little") + info
        path.write_bytes(content[:4] + (len(content) - 8).to_bytes(4, "little") + content[8:])

    return "wav", make


def tektronix(path, i):
    said = [["Record Length", "2048"], ["Sample Interval", "2e-4"], ["Trigger Point", "0"], ["", ""], ["", ""]]
    said += [["Source", "{}"], ["Vertical Units", "{}"], ["Vertical Scale", "1.0"], ["Horizontal Units", "s"]]
    said += [["", ""]] * (len(TIME) - len(said))
    lines = []
    for (key, value), t, m, e in zip(said, TIME, *samples(i), strict=True):
        parts = []
        for name, unit, x in (("Motor", "mm/s", m), ("Edge", "um/s", e)):
            parts.append(f"{key},{value.format(name if key == 'Source' else unit)},,{t:.7f},{x:.6f},")
        lines.append(",".join(parts))
    path.write_text("\n".join(lines) + "\n")


def rigol(path, i):
    lines = [f"{k},{m:.6e},{e:.6e}," for k, (m, e) in enumerate(zip(*samples(i), strict=True))]
    head = ["X,Motor,Edge,Start,Increment,", f"Sequence,mm/s,um/s,0.0,{1 / RATE:.9e}"]
    path.write_text("\n".join([*head, *lines]) + "\n")


VIBROMETER = ["Source File Name: a.pvd", "Component: Root Point", "Signal: Time - Velocity - Samples"]
READ = {
    "hdf5 Units": attributes("Units"),
    "hdf5 bytes": attributes("Engineering_Units", lambda unit: np.bytes_(unit)),
    "hdf5 list of one": attributes("unit", lambda unit: [unit]),
    "hdf5 words": attributes("UnitOfMeasure", {"mm/s": "Millimetres per second", "um/s": "µm·s⁻¹"}.get),
    "hdf5 groups": hdf5(own_groups),
    "hdf5 sibling": hdf5(lambda *a: own_groups(*a, how="sibling")),
    "hdf5 beside": hdf5(beside),
    "hdf5 named by the group": hdf5(named_by_the_group),
    "hdf5 inherited": hdf5(inherited),
    "hdf5 columns": hdf5(of_columns(["mm/s", "um/s"])),
    "hdf5 columns in a text": hdf5(of_columns("mm/s, um/s")),
    "hdf5 table of units": hdf5(table_of_units),
    "hdf5 German": attributes("Einheit"),
    "mat struct": mat(lambda m, e: {"Motor": {"Data": m, "Units": "mm/s"}, "Edge": {"Data": e, "Units": "um/s"}}),
    "mat struct array": mat(struct_array),
    "mat variables": mat(lambda m, e: {"Motor": m, "Edge": e, "Motor_units": "mm/s", "Edge_units": "um/s"}),
    "mat units of both": mat(lambda m, e: {"Motor": m / 1e-3, "Edge": e, "Units": "um/s"}),
    "mat nested label": mat(y_values),
    "mat cell": mat(lambda m, e: {"x": np.column_stack([m, e]), "units": np.array(["mm/s", "um/s"], object)}),
    "mat table": mat(lambda m, e: {"d": {"Motor": m, "Edge": e}, "units": {"Motor": "mm/s", "Edge": "um/s"}}),
    "mat 7.3": mat73(structs73),
    "mat 7.3 struct array": mat73(struct_array73),
    "tdms unit_string": tdms({"unit_string": ("mm/s", "um/s")}),
    "tdms NI_UnitDescription": tdms({"NI_UnitDescription": ("mm/s", "um/s")}),
    "tdms twice": tdms({"NI_UnitDescription": ("mm/s", "um/s"), "unit_string": ("mm/sec", "µm/s")}),
    "tdms Unit": tdms({"Unit": ("mm/s", "microns/second")}),
    "tdms group": tdms({}, group={"Edge_Unit": "um/s", "Motor_Unit": "mm/s"}),
    "tdms file": tdms({"Unit": ("mm/s", "")}, root={"EngineeringUnits": "um/s"}),
    "uff label": universal(("mm/s", "um/s")),
    "uff units of the file": universal(None, 1.0),
    "uff mm": universal(None, 1000.0),
    "csv brackets inside": text(["Time (s),Velocity [mm/s] Motor,Velocity [um/s] Edge"]),
    "csv header of tabs": text(["Time [s]\tMotor [mm/s]\tEdge [um/s]"], ";"),
    "csv header of spaces": text(["Time [s]  Motor [mm/s]  Edge [um/s]"], "\t", ending="txt"),
    "csv units line": text(["# Units: s, mm/s, um/s", "t,Motor,Edge"]),
    "csv VUnit": text(['"Trace","Motor","Edge"', '"VUnit","mm/s","um/s"', '"HUnit","s"', ""], row=",{}", time=False),
    "csv Vertical Units": text(
        ["Model,X1", "Horizontal Units,s,", "Vertical Units,mm/s,um/s", "Label,,", "TIME,Motor,Edge"]
    ),
    "csv one unit unknown": text(["Time,Motor,Edge,Aux", "s,mm/s,um/s,bogus"], row="{},1.0"),
    "txt vibrometer": text([*VIBROMETER, "Time\tMotor\tEdge", "[ s ]\t[ mm/s ]\t[ um/s ]"], "\t", ending="txt"),
    "lvm": text(
        ["LabVIEW Measurement\t", "***End_of_Header***\t", "Channels\t2\t\t", "Y_Unit_Label\tmm/s\tum/s\t",
         "X_Dimension\tTime\tTime\t", f"Delta_X\t{1 / RATE}\t{1 / RATE}\t", "***End_of_Header***\t\t\t",
         "X_Value\tMotor\tEdge\tComment"], "\t", ending="lvm"),
    "wav": wav("vibrometer\nUnits: mm/s, um/s"),
    "Tektronix": ("csv", tektronix),
    "Rigol": ("csv", rigol),
}  # fmt: skip
REFUSED = {
    "hdf5 two units": (hdf5(two_units), "sensor.per", "Units = um/s, unit = mm/s"),
    "hdf5 number": (set_unit("Units", 7), "sensor.per", "Units is no text"),
    "hdf5 not known": (set_unit("Units", "furlong"), "sensor.per", "'furlong', which is no unit"),
    "hdf5 peak": (set_unit("Units", "um/s pk"), "sensor.per", "'um/s pk'"),
    "hdf5 case tells": (set_unit("Units", "MV"), "sensor.per", "'MV'"),
    "hdf5 shown": (set_unit("DisplayUnit", "um/s"), "sensor.per", "DisplayUnit = um/s"),
    "hdf5 three for two": (hdf5(of_columns(["s", "mm/s", "um/s"])), "sensor.per", "is no text of a unit"),
    "mat name": (mat(lambda m, e: {"Motor": m, "Edge_um_s": e}), "sensor.per", "ends with um_s"),
    "mat not known": (mat(lambda m, e: {"Motor": m, "Edge": e, "units": "lsb"}), "sensor.per", "'lsb'"),
    "tdms two units": (tdms({"NI_UnitDescription": ("V", "V"), "unit_string": ("mm/s", "um/s")}), "sensor.per", "V"),
    "tdms counts": (tdms({"unit_string": ("mm/s", "Counts")}), "sensor.per", "'Counts'"),
    "uff not known": (universal(("mm/s", "parsec")), "sensor.per", "'parsec'"),
    "uff odd length": (universal(None, 17.0), "sensor.per", "data set 164"),
    "csv name": (text(["Time (s),Motor mm/s,Edge um/s"]), "sensor.per", "ends with um/s"),
    "csv other bracket": (text(["Time (s),Motor (mm/s),Edge (fur/s)"]), "sensor.per", "(fur/s)"),
    "csv more names": (text(["Time (s),Motor (mm/s),Edge (um/s),Remark"]), "sensor.per", "mentions mm/s, um/s"),
    "csv comment": (text(["# velocities in um/s", "t (s),Motor,Edge"]), "sensor.per", "mentions um/s"),
    "wav speech": (wav("velocity [um/s]"), "sensor.per", "mentions um/s"),
    "wav parts of full scale": (wav("", "<i4"), "sensor.unit", "says FS"),
    "wav both": (wav("Units: mm/s, um/s", "<i4"), "sensor.per", "parts of full scale, and its remarks say"),
    "csv unit not known": (text(["Time,Motor,Edge", "s,mm/s,foo"]), "sensor.per", "'foo'"),
}


def campaign(folder, case, motor, edge, more=""):
    ending, make = case
    for i in range(3):
        make(folder / f"e{i}.{ending}", i)
    names = [f"e{i}.{ending}" for i in range(3)]
    (folder / "c.toml").write_text(
        f'name = "t"\n[sensor]\nquantity = "velocity"\nunit = "mm/s"\n{more}[recording]\nrate_hz = {RATE}\n'
        f'channel = {edge}\nmotor_channel = {motor}\n[[unit]]\nname = "u"\nedge = {names}\n'
    )
    return measure(read_campaign(folder / "c.toml"), folder)


def channels_of(folder, case):
    """Return the numbers of the motor's and the edge's channel; the edge's numbers are larger."""
    ending, make = case
    make(folder / f"look.{ending}", 9)
    recording = open_recording(folder / f"look.{ending}")
    sizes = {i: np.ptp(np.asarray(c.samples, float)) for i, c in enumerate(recording.channels) if i != recording.time}
    names = {i: recording.channels[i].name.casefold() for i in sizes}
    edge = next((i for i, name in names.items() if "edge" in name), max(sizes, key=sizes.__getitem__))
    motor = next((i for i, name in names.items() if "motor" in name), min(sizes, key=sizes.__getitem__))
    return motor + 1, edge + 1


@pytest.mark.parametrize("name", READ)
def test_a_stated_unit_is_read(name, tmp_path):
    case = READ[name]
    more = ""
    result = campaign(tmp_path, case, *channels_of(tmp_path, case), more)
    assert result.levels, result.findings
    assert result.levels[0].level.value == pytest.approx(LEVEL, rel=2e-3)
    assert all(unit.stated for record in result.records["u"] for unit in record.units)


@pytest.mark.parametrize("name", REFUSED)
def test_a_unit_that_is_not_understood_is_refused(name, tmp_path):
    case, field, words = REFUSED[name]
    with refuses(field, words):
        campaign(tmp_path, case, *channels_of(tmp_path, case))


def velocities(folder, name, unit, scale, seed=0):
    """Write a text record of one channel of 100 mm/s."""
    x = scale * (100 * np.cos(2 * np.pi * 137.4 * TIME + seed) + np.random.default_rng(seed).standard_normal(len(TIME)))
    rows = "\n".join(f"{t:.9f},{v:.9g}" for t, v in zip(TIME, x, strict=True))
    head = f"v ({unit})" if unit else "v"
    (folder / f"{name}.csv").write_text(f"t (s),{head}\n{rows}\n")


def apart(folder, motor, edge, more=""):
    """Measure three records of the motor and three of the edge, each of a unit and a scale."""
    for letter, records in (("m", motor), ("e", edge)):
        for i, (unit, scale) in enumerate(records):
            velocities(folder, f"{letter}{i}", unit, scale, i + 9 * (letter == "e"))
    (folder / "c.toml").write_text(
        f'name = "t"\n[sensor]\nquantity = "velocity"\nunit = "mm/s"\n{more}[[unit]]\nname = "u"\n'
        'reference = ["m0.csv", "m1.csv", "m2.csv"]\nedge = ["e0.csv", "e1.csv", "e2.csv"]\n'
    )
    return measure(read_campaign(folder / "c.toml"), folder)


MM, UM, SILENT = ("mm/s", 1.0), ("um/s", 1e3), ("", 1.0)


def test_files_of_one_campaign_may_state_different_units(tmp_path):
    result = apart(tmp_path, [MM, UM, ("m/s", 1e-3)], [("um/s", 370.0), ("mm/s", 0.37), ("m/s", 0.37e-3)])
    assert result.levels[0].level.value == pytest.approx(0.37, rel=2e-3)
    assert [str(one.units[0]) for one in result.records["u"]] == ["mm/s", "um/s", "m/s", "um/s", "mm/s", "m/s"]


@pytest.mark.parametrize("side", [0, 1])
def test_a_file_without_a_unit_among_files_with_another_one_is_refused(side, tmp_path):
    sides = [[MM, MM, MM], [MM, MM, MM]]
    sides[side][1], sides[1 - side] = SILENT, [UM, UM, UM]
    with refuses("sensor.per", f"states um/s, and {'me'[side]}1.csv no unit"):
        apart(tmp_path, *sides)
    settled = apart(tmp_path, *sides, 'per = "mm/s"\n')
    assert settled.levels[0].level.value == pytest.approx(1.0, rel=2e-3)


def test_a_file_that_states_a_wrong_unit_gives_no_level(tmp_path):
    result = apart(tmp_path, [MM, MM, MM], [MM, ("um/s", 1.0), MM])
    assert result.levels == ()
    (found,) = [one for one in result.findings if one.code == "L109"]
    assert found.severity == "error"
    assert "factor of 1e+03, read in mm/s: e0.csv, e2.csv, um/s: e1.csv" in found.message


@pytest.mark.parametrize(
    ("stated", "factor", "refused"),
    [("", 370.0, True), ("", 2.9, False), ("", 1.1e-3, False), ("", 0.9e-3, True), ("mm/s", 2e-4, False)],
)
def test_a_level_out_of_range_is_refused_with_the_units(stated, factor, refused, tmp_path):
    """A file that states no unit may be a prefix off: an edge at 0.04 to 0.9 of the motor's then seems to be below 0.001."""
    edge = [(stated, factor)] * 3
    if refused:
        with refuses("u, edge", "read in mm/s (not stated) at the place and mm/s at the motor"):
            apart(tmp_path, [MM] * 3, edge)
    else:
        assert apart(tmp_path, [MM] * 3, edge).levels[0].level.value == pytest.approx(factor, rel=2e-3)


def test_a_name_that_ends_with_the_declared_unit_needs_no_more(tmp_path):
    for i in range(3):
        motor, edge = samples(i, 1.0)
        savemat(tmp_path / f"e{i}.mat", {"Motor": motor, "Edge_mm": edge})
    text = (
        f'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "mm"\n[recording]\nrate_hz = {RATE}\nchannel = 2\n'
        'motor_channel = 1\n[[unit]]\nname = "u"\nedge = ["e0.mat", "e1.mat", "e2.mat"]\n'
    )
    (tmp_path / "c.toml").write_text(text)
    assert measure(read_campaign(tmp_path / "c.toml"), tmp_path).levels
    (tmp_path / "c.toml").write_text(text.replace('unit = "mm"', 'unit = "um"'))
    with refuses("sensor.per", "its name ends with mm"):
        measure(read_campaign(tmp_path / "c.toml"), tmp_path)


@pytest.mark.parametrize(
    ("unit", "texts"),
    [
        ("um/s", "µm/s μm/s Âµm/s um·s⁻¹ um*s^-1 um.s-1 micrometers/second UM/S um/sec (um/s) [µm/s]"),
        ("m/s2", "m/s² m/s^2 m/s**2 m/s/s m·s⁻² m/sec2 m/sec^2 M/S2 metre/second² m/(s^2) mps2"),
        ("g", "g G g's gn [g]"),
        ("V", "V Volt volts VOLTS (V)"),
        ("mV", "mV millivolts"),
        ("um", "um µm micron Microns micrometre"),
        ("in/s", "in/s ips inch/sec IN/S"),
        ("kPa", "kPa KPA"),
    ],
)
def test_one_unit_in_many_spellings(unit, texts):
    assert {plain(text) for text in texts.split()} == {unit}


@pytest.mark.parametrize("text", ["NM", "Nm", "MV", "MA", "Mm", "mm/ms", "mm/s RMS", "m2/s", "counts", "?m/s", "1", ""])
def test_no_spelling_of_another_unit_is_taken_for_one(text):
    assert not is_signal_unit(text)
